"""What a plan promises: every difference becomes a step with its cause, and no difference becomes no step."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from swarm_onboard.agent.deployed import Transaction
from swarm_onboard.agent.steps import Kind
from swarm_onboard.agent.verbs.observe import Facts

from swarmctl.plan.observed_host import NOTHING, Observed
from swarmctl.plan.plan import HostPlan
from swarmctl.plan.reconcile import reconcile
from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle, File, Unit, package, workspace
from tests import ROOT
from tests.loading import load_swarm
from tests.onboard.agent.fakehost import RUNS

FIT = Facts(
    "pi", "armv7l", "3.8.10", True, 0, "b", 0.0, 1, 1,
    {"roscore": None, "rospy": "/x", "pyserial": "/y"}, [], "", None, None,
)  # fmt: skip


def bundle(**contents: str) -> Bundle:
    """Two robots with a driver unit each; ``contents`` changes a file by its stem."""
    text = {"a": "a1", "b": "b1", "env": "e1", "unit_a": "ua", "unit_b": "ub", "hosts": "h"} | contents
    paths = {
        "a": "params/a.yaml", "b": "params/b.yaml", "env": "env/ros.env",
        "unit_a": "units/a.service", "unit_b": "units/b.service", "hosts": "hosts/block",
    }  # fmt: skip
    return Bundle(
        swarm="s",
        host="pi",
        files=tuple(File(paths[name], text[name].encode(), origin=f"robots.{name}") for name in paths),
        units=(
            Unit("a.service", ("units/a.service", "params/a.yaml", "env/ros.env"), robot="a"),
            Unit("b.service", ("units/b.service", "params/b.yaml", "env/ros.env"), robot="b"),
            Unit("s.target", ()),
        ),
        links={
            "/etc/systemd/system/a.service": "units/a.service",
            "/etc/systemd/system/b.service": "units/b.service",
        },
        blocks={"/etc/hosts": "hosts/block"},
    )


def running(released: Bundle, **changes: object) -> Observed:
    """A sound host that runs ``released``."""
    units = {unit.name: RUNS for unit in released.units}
    return replace(Observed(released.digest, released.manifest, units=units), **changes)


def lines(plan: HostPlan) -> list[str]:
    return [f"{step.kind} {step.target}: {step.cause}" for step in plan.steps]


def test_a_sound_host_with_the_same_release_has_nothing_to_do() -> None:
    assert reconcile(bundle(), running(bundle())).steps == ()


def test_the_first_deploy_creates_all_and_starts_it_in_order() -> None:
    plan = reconcile(bundle(), NOTHING)
    assert plan.previous is None
    assert plan.targets(Kind.CREATE) == tuple(file.path for file in bundle().files)
    assert plan.targets(Kind.START) == ("a.service", "b.service", "s.target")
    assert plan.targets(Kind.RELOAD) == ("systemd",)
    assert "activate " in "".join(lines(plan))


def test_one_changed_parameter_restarts_one_unit_and_says_why() -> None:
    plan = reconcile(bundle(a="a2"), running(bundle()))
    assert lines(plan) == [
        "update params/a.yaml: changed, from robots.a",
        f"activate {bundle(a='a2').digest}: replaces {bundle().digest}",
        "restart a.service: params/a.yaml changes",
    ]


def test_no_changed_file_of_a_host_is_overlooked() -> None:
    swarm, found = load_swarm(ROOT / "examples/paper-leader/swarm.yaml")
    assert swarm is not None, found
    for before in bundles(swarm).values():
        for number, file in enumerate(before.files):
            changed = replace(file, content=file.content + b"\n# changed\n", fixed=None)
            files = (*before.files[:number], changed, *before.files[number + 1 :])
            plan = reconcile(replace(before, files=files), running(before))

            assert plan.targets(Kind.UPDATE) == (file.path,)
            readers = {unit.name for unit in before.units if file.path in unit.needs}
            assert readers <= {*plan.targets(Kind.RESTART), *plan.targets(Kind.RELOAD_UNIT)}, file.path


def test_a_changed_environment_restarts_every_unit_that_reads_it() -> None:
    plan = reconcile(bundle(env="e2"), running(bundle()))
    assert plan.targets(Kind.RESTART) == ("a.service", "b.service")


def test_a_changed_unit_file_reloads_systemd() -> None:
    plan = reconcile(bundle(unit_b="new"), running(bundle()))
    assert plan.targets(Kind.RELOAD) == ("systemd",)
    assert plan.targets(Kind.RESTART) == ("b.service",)


def test_the_hosts_block_changes_without_any_restart() -> None:
    plan = reconcile(bundle(hosts="other"), running(bundle()))
    assert plan.targets(Kind.BLOCK) == ("/etc/hosts",)
    assert plan.targets(Kind.RESTART, Kind.START, Kind.STOP, Kind.RELOAD) == ()


PREPARED = replace(
    bundle(),
    files=(*bundle().files, File("chrony/block", b"x"), File("network/wlan.conf", b"x")),
    links={**bundle().links, "/etc/NetworkManager/conf.d/s.conf": "network/wlan.conf"},
    blocks={**bundle().blocks, "/etc/chrony/chrony.conf": "chrony/block"},
    wants={"chronyd": (), "iw": ()},
    follows="hub",
)
WITHOUT = ["/etc/NetworkManager/conf.d", "/etc/chrony/chrony.conf"]


def test_files_outside_are_planned_only_with_their_program() -> None:
    plan = reconcile(PREPARED, running(bundle()))
    assert plan.targets(Kind.BLOCK) == ("/etc/chrony/chrony.conf",)
    assert plan.targets(Kind.RELOAD) == ("chrony", "NetworkManager")
    bare = reconcile(PREPARED, running(bundle(), facts=FIT._replace(absent=WITHOUT)))
    assert bare.targets(Kind.BLOCK, Kind.LINK, Kind.RELOAD) == ()


def test_a_host_that_cannot_write_its_boards_drives_all_the_same() -> None:
    rover = replace(bundle(), wants={"avrdude": ()})
    without = reconcile(rover, running(rover, facts=FIT._replace(has={}, power_save={})))
    assert without.problem is None
    [note] = without.notes
    assert "it lacks avrdude" in note
    assert "apt install avrdude" in note


def test_what_to_set_on_a_robot_is_a_note_until_the_deploy() -> None:
    by_hand = replace(bundle(a="a2"), by_hand=("robot a runs nodes itself",))
    assert reconcile(by_hand, running(bundle())).notes == by_hand.by_hand
    assert reconcile(by_hand, running(by_hand)).notes == ()


@pytest.mark.parametrize(
    ("facts", "notes"),
    [
        ({"has": {"chronyd": "/x", "iw": "/x"}, "clock": "follows", "power_save": {"wlan0": "off"}}, []),
        ({"has": {"chronyd": "/x"}, "clock": "borrowed", "power_save": {}}, []),
        ({"has": {}, "power_save": {"wlan0": ""}}, ["it lacks chrony", "it lacks iw"]),
        ({"has": {"chronyd": "/x"}, "clock": "alone", "power_save": {}}, ["does not follow hub"]),
        (
            {"has": {"chronyd": "/x", "iw": "/x"}, "clock": "follows", "power_save": {"wlan0": "on"}},
            ["wlan0 has power saving on"],
        ),
    ],
)
def test_missing_tools_are_notes_with_a_fix_and_no_problem(facts: dict[str, Any], notes: list[str]) -> None:
    plan = reconcile(PREPARED, running(PREPARED, facts=FIT._replace(**facts)))
    assert plan.problem is None
    assert len(plan.notes) == len(notes)
    for note, words in zip(plan.notes, notes, strict=True):
        assert words in note
        assert "`" in note


def test_what_left_the_spec_is_stopped_unlinked_and_deleted() -> None:
    whole = bundle()
    smaller = replace(
        whole,
        files=tuple(file for file in whole.files if "b." not in file.path),
        units=(whole.units[0], whole.units[2]),
        links={"/etc/systemd/system/a.service": "units/a.service"},
    )
    plan = reconcile(smaller, running(whole))
    assert plan.targets(Kind.STOP) == ("b.service",)
    assert plan.targets(Kind.UNLINK) == ("/etc/systemd/system/b.service",)
    assert plan.targets(Kind.DELETE) == ("params/b.yaml", "units/b.service")
    assert plan.targets(Kind.RESTART, Kind.START) == ()
    order = [step.kind for step in plan.steps]
    assert order.index(Kind.STOP) < order.index(Kind.ACTIVATE) < order.index(Kind.UNLINK)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"drift": {"params/a.yaml": "changed"}}, ["update params/a.yaml: was changed on the host"]),
        ({"drift": {"params/a.yaml": "missing"}}, ["update params/a.yaml: is missing on the host"]),
        ({"drift": {"junk": "extra"}}, ["delete junk: is not part of the release"]),
    ],
)
def test_a_file_touched_on_the_host_is_put_right(change: dict[str, object], expected: list[str]) -> None:
    plan = reconcile(bundle(), running(bundle(), **change))
    assert lines(plan)[: len(expected)] == expected
    assert f"activate {bundle().digest}: the release on the host is damaged" in lines(plan)


def test_only_the_unit_that_reads_the_touched_file_restarts() -> None:
    plan = reconcile(bundle(), running(bundle(), drift={"params/a.yaml": "changed"}))
    assert lines(plan)[-1] == "restart a.service: params/a.yaml was changed on the host"
    assert plan.targets(Kind.RESTART, Kind.START) == ("a.service",)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (
            {"links": {"/etc/systemd/system/a.service": "missing"}},
            "link /etc/systemd/system/a.service: is missing on the host",
        ),
        (
            {"links": {"/etc/systemd/system/x.service": "extra"}},
            "unlink /etc/systemd/system/x.service: is not part of the release",
        ),
        ({"blocks": {"/etc/hosts": "changed"}}, "write-block /etc/hosts: its block was changed on the host"),
    ],
)
def test_what_points_into_the_release_is_put_right(change: dict[str, object], expected: str) -> None:
    assert expected in lines(reconcile(bundle(), running(bundle(), **change)))


@pytest.mark.parametrize(
    ("state", "cause"),
    [
        ("applying", "an earlier deploy was interrupted: x -> y by someone"),
        ("removing", "the removal of the swarm is not finished, by someone"),
    ],
)
def test_an_interrupted_change_is_resumed(state: str, cause: str) -> None:
    plan = reconcile(bundle(), running(bundle(), transaction=transaction(state)))
    assert lines(plan) == [f"activate {bundle().digest}: {cause}"]


def test_a_deploy_that_the_host_has_undone_is_named_with_its_cause() -> None:
    seen = running(bundle(), transaction=transaction("undone", "the host restarted"), facts=FIT)
    plan = reconcile(bundle(), seen)
    assert plan.notes == ("the deploy of release y by someone did not stay: the host restarted",)
    assert reconcile(bundle(), running(bundle(), transaction=transaction("applied"))).notes == ()


def transaction(state: str, error: str = "") -> Transaction:
    return Transaction("t", state, "someone", "x", "y", 0.0, error)


@pytest.mark.parametrize(
    ("ahead", "shown"),
    [
        (-50 * 365.25 * 86400, "differ by 50 years"),
        (10 * 365.25 * 86400, "differ by 10 years"),
        (61.0, "differ by 61 s"),
        (30.0, ""),
    ],
)
def test_a_clock_that_is_far_off_is_a_note(ahead: float, shown: str) -> None:
    plan = reconcile(bundle(a="a2"), running(bundle(), clock_ahead=ahead, facts=FIT))
    assert plan.problem is None
    assert any(shown in note for note in plan.notes) if shown else plan.notes == ()


def test_a_unit_that_somebody_wrote_in_the_swarms_name_is_a_note() -> None:
    plan = reconcile(bundle(), running(bundle(), foreign_units=("swarm-s.old.service",), facts=FIT))
    assert plan.steps == ()
    assert "sudo systemctl disable --now swarm-s.old.service, then sudo rm /etc/systemd/" in plan.notes[0]


def test_diffs_show_what_changes_and_only_that() -> None:
    seen = running(bundle(), contents={file.path: file.content.decode() for file in bundle().files})
    plan = reconcile(bundle(a="a2"), seen, diff=True)
    assert set(plan.diffs) == {"params/a.yaml"}
    assert "-a1" in plan.diffs["params/a.yaml"]
    assert "+a2" in plan.diffs["params/a.yaml"]


def test_the_json_form_says_the_same() -> None:
    document = reconcile(bundle(a="a2"), running(bundle())).to_json()
    assert [step["kind"] for step in document["steps"]] == ["update", "activate", "restart"]
    assert document["problem"] is None


@pytest.mark.parametrize(
    ("facts", "complaint"),
    [
        ({}, None),
        ({"systemd": False}, "does not run systemd"),
        ({"python": "3.6.9"}, "its Python is 3.6.9"),
        ({"python": "nonsense"}, "its Python is nonsense"),
        ({"has": {"rospy": None, "pyserial": None}}, "it lacks rospy, pyserial"),
    ],
)
def test_a_host_that_cannot_run_its_part_is_a_problem(facts: dict[str, Any], complaint: str | None) -> None:
    wanted = replace(bundle(), requires={"rospy": (), "pyserial": ()})
    problem = reconcile(wanted, running(bundle(), facts=FIT._replace(**facts))).problem
    assert (
        (problem is None)
        if complaint is None
        else (problem is not None and complaint in problem.message and problem.hint)
    )


def test_a_file_for_another_machine_is_refused() -> None:
    head = b"\x7fELF\x02\x01\x01" + bytes(9) + b"\x03\x00\xb7\x00"  # aarch64
    node = File("packages/nav/lib/nav/node", head, 0o755, "packages.nav")
    wanted = replace(bundle(), files=(*bundle().files, node))
    assert reconcile(wanted, running(bundle(), facts=FIT._replace(machine="aarch64"))).problem is None

    problem = reconcile(wanted, running(bundle(), facts=FIT._replace(machine="x86_64"))).problem

    assert problem is not None
    assert problem.message == "its machine is x86_64, and packages/nav/lib/nav/node is compiled for aarch64"
    assert problem.hint == "build packages.nav for x86_64"


def test_a_secret_that_nobody_has_stops_a_program_and_no_robot() -> None:
    plain = bundle()
    robot = replace(plain.units[0], secrets=("epuck-pin",))
    web = Unit("web.service", ("params/a.yaml",), program="web", secrets=("web-token",))
    names, forms = ("epuck-pin", "web-token"), {"web-token": "line"}
    wanted = replace(plain, units=(robot, *plain.units[1:], web), secrets=names, secret_forms=forms)

    unfit = reconcile(wanted, running(plain, secrets=dict.fromkeys(wanted.secrets, "missing"), facts=FIT))

    assert unfit.problem is not None
    assert unfit.problem.message == "program web needs the secret web-token, which is not on the host"
    assert "`secrets/web-token` beside the spec" in unfit.problem.hint
    fit = reconcile(wanted, running(plain, secrets={"epuck-pin": "missing", "web-token": "kept"}, facts=FIT))
    assert fit.problem is None
    assert ["epuck-pin" in note for note in fit.notes] == [True]


def test_a_missing_ros_package_has_an_install_hint() -> None:
    needs = (package("fkie_master_sync"), package("joy"), workspace("/home/robot/ws"))
    wanted = replace(bundle(), requires=dict.fromkeys(needs, ()))
    has = dict.fromkeys(needs) | {package("joy"): "/opt/ros/noetic/share/joy"}

    problem = reconcile(wanted, running(bundle(), facts=FIT._replace(has=has))).problem

    assert problem is not None
    assert problem.message == (
        "it lacks the ROS package fkie_master_sync, a built ROS workspace in /home/robot/ws"
    )
    assert "`apt install ros-noetic-fkie-master-sync`" in problem.hint
    assert "`multimaster: {provider: static}` in the spec: swarmctl's bridge needs no package" in problem.hint
    assert "catkin_make" in problem.hint


def test_a_missing_tool_has_its_debian_package_as_hint() -> None:
    wanted = replace(bundle(), requires={"nft": ("security",)})
    problem = reconcile(wanted, running(bundle(), facts=FIT._replace(has={"nft": None}))).problem
    assert problem is not None
    assert problem.message == "it lacks nft"
    assert problem.hint == "`swarmctl prepare` installs it; by hand: `apt install nftables`"


def test_a_host_whose_peers_have_no_pinned_key_is_unfit() -> None:
    problem = reconcile(replace(bundle(), unpinned=("k3-pi",)), running(bundle(), facts=FIT)).problem
    assert problem is not None
    assert problem.message == "the WireGuard keys of k3-pi are not pinned"
    assert problem.hint == "`swarmctl trust` pins them"


def test_a_host_that_leaves_the_graph_loses_everything() -> None:
    nothing = Bundle(swarm="s", host="pi")
    plan = reconcile(nothing, running(bundle()))
    assert plan.targets(Kind.STOP) == ("s.target", "b.service", "a.service")
    assert set(plan.targets(Kind.DELETE)) == {file.path for file in bundle().files}
    assert set(plan.targets(Kind.UNLINK)) == set(bundle().links)
    assert plan.targets(Kind.BLOCK) == ("/etc/hosts",)
    assert reconcile(nothing, running(nothing)).steps == ()
    assert reconcile(nothing, NOTHING).steps == ()
