"""Changing a swarm that runs: what a change concerns restarts, and nothing else."""

from __future__ import annotations

import re
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.e2e.lab_swarm import (
    HOME,
    LEADER,
    LabSwarm,
    Note,
    moves,
    until,
)

K3 = "k3: {type: khepera3, host: k3-pi}"
FASTER_K3 = "k3: {type: khepera3, host: k3-pi, settings: {rates: {odom: 20, light: 2}}}"
SLOWER_K3 = "k3: {type: khepera3, host: k3-pi, settings: {limits: {linear: 0.05}}}"
K3_UNIT = "swarm-newswarm.k3.service"
MASTER_UNIT = "swarm-newswarm.master.service"
UNITS = "/etc/systemd/system"
EPUCK_LINK = (
    "  - {kind: bluetooth, host: epuck-pi, robot: epuck, "
    'mac: "10:00:e8:c5:64:37", pin: {secret: epuck-pin}}\n'
)


@pytest.fixture(scope="module")
def faster_k3(shared_lab: LabSwarm) -> Path:
    """The spec with one parameter of one robot changed."""
    return shared_lab.variant("faster-k3", (K3, FASTER_K3))


def changed(before: dict[str, int], after: dict[str, int]) -> set[str]:
    """The units whose main process has changed."""
    return {unit for unit in before.keys() | after.keys() if before.get(unit) != after.get(unit)}


def test_a_parameter_of_one_robot_changes_one_file_and_one_unit(swarm: LabSwarm, faster_k3: Path) -> None:
    steps = swarm.steps(faster_k3)
    assert set(steps) == {"k3-pi"}
    (file, activate, restart) = steps["k3-pi"]
    assert file == ("update", "params/k3.yaml", "changed, from robots.k3")
    assert activate[0] == "activate"
    assert restart == ("restart", K3_UNIT, "params/k3.yaml changes")


def test_its_deploy_stops_that_robot_while_the_others_drive_on(
    swarm: LabSwarm, faster_k3: Path, note: Note
) -> None:
    before = swarm.pids()
    with ExitStack() as stack:
        speeds = {"k3": 0.1, "epuck": 0.05, "koala": 0.2}
        publishers = {
            robot: stack.enter_context(swarm.publishing(LEADER, robot, speed))
            for robot, speed in speeds.items()
        }
        until(lambda: all(map(moves, swarm.robots().values())), "not every robot moves")
        refused = swarm.deploy(faster_k3)
        assert refused.status == 3, refused.out + refused.err
        assert re.search(r"^k3-pi  busy: k3 (is commanded by|moves)", refused.out, re.MULTILINE), refused.out
        assert changed(before, swarm.pids()) == set()
        deploy = stack.enter_context(swarm.begin("deploy", "--stop-robots", spec=faster_k3))
        others_stood = []

        def k3_stands(wanted: bool) -> bool:
            states = swarm.robots()
            others_stood.extend(robot for robot in ("epuck", "koala") if not moves(states[robot]))
            return moves(states["k3"]) is not wanted

        until(lambda: k3_stands(True), "k3 drives on while its driver is swapped")
        assert deploy.wait(30) == 0, deploy.communicate()
        assert k3_stands(True)  # though its commands go on
        assert swarm.swarmctl("start", "k3").status == 0
        obeyed = until(lambda: k3_stands(False), "k3 does not obey its new driver")
        assert not others_stood
        note("k3 obeys its new driver after its start", f"{obeyed:.2f} s", "")
        for publisher in publishers.values():
            publisher.kill()
    assert changed(before, swarm.pids()) == {"k3-pi:k3"}
    assert swarm.units("k3-pi")["k3"].restarts == 0
    assert "rate: 20.0" in swarm.shell("k3-pi", f"cat {HOME}/current/params/k3.yaml")


def test_a_robot_that_drives_takes_a_lower_limit(swarm: LabSwarm, note: Note) -> None:
    slower = swarm.variant("slower-k3", (K3, SLOWER_K3))
    taken = ("reload-unit", K3_UNIT, "params/k3.yaml changes, and it takes that while it runs")
    assert swarm.steps(slower)["k3-pi"][-1] == taken
    before = swarm.pids()
    with swarm.driving(LEADER, "k3", 0.1):
        deploy = swarm.begin("deploy", spec=slower)
        fast = speed(swarm)
        slowed = until(lambda: speed(swarm) < 0.6 * fast, "k3 does not take its limit")
        assert moves(swarm.robot("k3"))
        assert deploy.wait(60) == 0, deploy.communicate()
        note("deploy, until a robot that drives has its new limit", f"{slowed:.2f} s", "")
        assert swarm.swarmctl("status", spec=slower).status == 0
        assert speed(swarm) == pytest.approx(fast / 2, rel=0.05)
    assert changed(before, swarm.pids()) == set()
    assert swarm.swarmctl("rollback", "--yes").status == 0
    with swarm.driving(LEADER, "k3", 0.1):
        until(lambda: speed(swarm) == pytest.approx(fast, rel=0.05), "k3 keeps the lower limit")
    assert changed(before, swarm.pids()) == set()


def speed(swarm: LabSwarm) -> float:
    """How fast both wheels of k3 turn, in its own units."""
    state = swarm.robot("k3")
    return float(state["left"] + state["right"])


def test_a_master_does_not_stop_under_a_robot_of_another_host(swarm: LabSwarm, note: Note) -> None:
    address = "koala-laptop: {address: 192.168.77.10, "
    other_port = swarm.variant("other-port", (address, f"{address}master_port: 11411, "))
    before = swarm.pids()
    stopped = f"systemctl show -P InactiveEnterTimestampMonotonic {MASTER_UNIT}"
    with swarm.driving(LEADER, "epuck", 0.05):
        refused = swarm.deploy(other_port, "--limit", LEADER)
        assert refused.status == 3, refused.out + refused.err
        busy = rf"busy: epuck on epuck-pi is commanded by {LEADER} \(.+\), and depends on {MASTER_UNIT}"
        assert re.search(busy, refused.out), refused.out
        assert changed(before, swarm.pids()) == set()
        assert moves(swarm.robot("epuck"))
        with swarm.begin("deploy", "--stop-robots", "--limit", LEADER, spec=other_port) as deploy:
            until(lambda: not moves(swarm.robot("epuck")), "the e-puck drives on")
            stood = time.monotonic()  # hosts of the lab have the same clock
            assert deploy.wait(60) == 0, deploy.communicate()
            ahead = int(swarm.shell(LEADER, stopped)) / 1e6 - stood
            assert ahead > 0, f"the wheels turned for {-ahead:.2f} s without a master"
            note("the last wheel of another host stands before its master stops", f"{ahead:.2f} s", "> 0 s")
            assert not moves(swarm.robot("epuck"))  # though its commands go on
    assert "epuck-pi:epuck" not in changed(before, swarm.pids())
    assert swarm.swarmctl("start").status == 0
    assert swarm.deploy().status == 0
    # Before they notice another master. A driver that has just started is refused until its robot stands.
    until(lambda: swarm.swarmctl("restart", "k3", "epuck").status == 0, "the drivers do not restart")


def test_a_robot_that_was_not_idle_long_enough_keeps_its_driver(swarm: LabSwarm) -> None:
    terms = "maintenance: {idle: 86400, battery: 0.5}}"
    patient = swarm.variant("patient", (K3, f"{K3[:-1]}, {terms}"))
    changing = swarm.variant("patient-faster", (K3, f"{FASTER_K3[:-1]}, {terms}"))
    before = swarm.pids()
    assert swarm.deploy(patient).status == 0
    refused = swarm.deploy(changing)
    assert refused.status == 3, refused.out + refused.err
    assert re.search(r"busy: k3 has been idle for \d+ s of the 86400 s of `maintenance`$", refused.out, re.M)
    assert swarm.deploy().status == 0  # without terms again
    assert changed(before, swarm.pids()) == set()


def test_the_last_deploy_can_be_taken_back(swarm: LabSwarm, faster_k3: Path) -> None:
    before = swarm.pids()
    runs = swarm.swarmctl("history", "--json").json()["runs"]
    assert swarm.deploy(faster_k3).status == 0
    back = swarm.swarmctl("rollback", "--yes")
    assert back.status == 0, back.out + back.err
    assert "1 of 3 hosts changed" in back.out
    assert "rate: 20.0" not in swarm.shell("k3-pi", f"cat {HOME}/current/params/k3.yaml")
    assert changed(before, swarm.pids()) == {"k3-pi:k3"}
    assert swarm.plan().status == 0
    deployed, taken_back = swarm.swarmctl("history", "--json").json()["runs"][len(runs) :]
    there, again = deployed["hosts"]["k3-pi"], taken_back["hosts"]["k3-pi"]
    assert (there["previous"], there["next"]) == (again["next"], again["previous"])


@pytest.mark.slow
def test_a_saved_plan_is_executed_as_it_was_or_refused(
    swarm: LabSwarm, faster_k3: Path, tmp_path: Path
) -> None:
    first, second = tmp_path / "first.plan", tmp_path / "second.plan"
    for path in (first, second):
        assert swarm.swarmctl("plan", "-o", str(path), spec=faster_k3).status == 0
    done = swarm.deploy(first)
    assert done.status == 0, done.out + done.err
    assert "1 of 3 hosts changed" in done.out
    assert "rate: 20.0" in swarm.shell("k3-pi", f"cat {HOME}/current/params/k3.yaml")
    again = swarm.deploy(second)
    assert again.status == 1, again.out + again.err
    assert "the plan is stale: somebody has deployed to k3-pi since" in again.err
    assert swarm.deploy().status == 0


@pytest.mark.slow
def test_an_edit_by_hand_comes_home_into_the_spec(swarm: LabSwarm) -> None:
    before = swarm.pids()
    spec = swarm.variant("midnight", (K3, K3))
    assert swarm.deploy(spec).status == 0
    path = f"{HOME}/current/params/k3.yaml"
    swarm.shell("k3-pi", f"sudo sed -i 's/^command_timeout: .*/command_timeout: 0.4  # carpet/' {path}")
    refused = swarm.deploy(spec)
    assert refused.status != 0
    assert f"swarmctl adopt {spec}" in refused.out + refused.err
    shown = swarm.swarmctl("adopt", spec=spec)
    assert shown.status == 0, shown.out + shown.err
    wanted = f"{K3[:-1]}, settings: {{command_timeout: 0.4}}}}"
    assert f"+  {wanted}" in shown.out
    assert K3 in spec.read_text()
    done = swarm.deploy(spec, "--adopt", "--yes")
    assert done.status == 0, done.out + done.err
    assert wanted in spec.read_text()
    assert swarm.plan(spec).status == 0
    assert "command_timeout: 0.4" in swarm.shell("k3-pi", f"cat {path}")
    assert changed(before, swarm.pids()) == {"k3-pi:k3"}


def test_a_file_edited_by_hand_is_named_and_repaired(swarm: LabSwarm) -> None:
    before = swarm.pids()
    path = f"{HOME}/current/params/k3.yaml"
    whole = swarm.shell("k3-pi", f"cat {path}")
    swarm.shell("k3-pi", f"sudo sed -i s/0.5/5.0/ {path}")
    steps = swarm.steps()
    assert ("update", "params/k3.yaml", "was changed on the host") in steps["k3-pi"]
    assert ("restart", K3_UNIT, "params/k3.yaml was changed on the host") in steps["k3-pi"]
    assert set(steps) == {"k3-pi"}
    refused = swarm.deploy()
    assert refused.status != 0
    assert "params/k3.yaml was edited on the host" in refused.out
    edited = swarm.shell("k3-pi", f"cat {path}")
    assert swarm.deploy(None, "--overwrite-edits").status == 0
    assert swarm.shell("k3-pi", f"cat {path}") == whole
    assert swarm.shell("k3-pi", f"sudo sh -c 'cat $(ls -t {HOME}/state/edits/*/k3.yaml | head -1)'") == edited
    assert changed(before, swarm.pids()) == {"k3-pi:k3"}
    assert swarm.plan().status == 0


@pytest.mark.slow
def test_etc_hosts_is_repaired_inside_our_block_only(swarm: LabSwarm) -> None:
    before = swarm.pids()
    swarm.shell(
        "epuck-pi",
        "echo 10.0.0.7 printer | sudo tee -a /etc/hosts; sudo sed -i 's/77.11 k3-pi/77.99 k3-pi/' /etc/hosts",
    )
    assert swarm.steps() == {"epuck-pi": [("write-block", "/etc/hosts", "its block was changed on the host")]}
    assert swarm.deploy().status != 0
    assert swarm.deploy(None, "--overwrite-edits").status == 0
    lines = swarm.shell("epuck-pi", "cat /etc/hosts").splitlines()
    assert "10.0.0.7 printer" in lines
    assert "192.168.77.11 k3-pi" in lines
    assert changed(before, swarm.pids()) == set()


def test_a_robot_taken_out_of_the_spec_is_gone_from_its_host(swarm: LabSwarm) -> None:
    without = swarm.variant(
        "without-epuck",
        ("  epuck: {type: epuck, host: epuck-pi}\n", ""),
        (EPUCK_LINK, ""),
        ("of: [koala, k3, epuck]", "of: [koala, k3]"),
    )
    before = swarm.pids()
    with swarm.driving(LEADER, "epuck", 0.05):
        run = swarm.deploy(without, "--stop-robots")
        assert run.status == 0, run.out + run.err
        assert not moves(swarm.robot("epuck"))
    assert swarm.swarmctl("start").status == 0
    assert changed(before, swarm.pids()) == {
        "epuck-pi:epuck",
        "epuck-pi:epuck.pair",
        "epuck-pi:epuck.rfcomm",
    }
    left = swarm.shell("epuck-pi", f"ls {UNITS} {UNITS}/multi-user.target.wants")
    assert "epuck" not in left
    assert "swarm-newswarm.target" in left
    assert swarm.plan(without).status == 0


def test_a_renamed_robot_obeys_by_its_new_name(swarm: LabSwarm) -> None:
    renamed = swarm.variant("walker")
    done = swarm.run("rename", str(renamed), "epuck", "walker", "--write")
    assert done.status == 0, done.out + done.err
    steps = [step[:2] for step in swarm.steps(renamed)["epuck-pi"]]
    old, new = ("stop", "swarm-newswarm.epuck.service"), ("start", "swarm-newswarm.walker.service")
    assert steps.index(old) < steps.index(new)  # both open the port
    with swarm.driving(LEADER, "epuck", 0.05):
        refused = swarm.deploy(renamed)
        assert re.search("busy: epuck (is commanded|moves)", refused.out), refused.out + refused.err
    swarm.seconds_to_standstill("epuck")
    done = swarm.deploy(renamed)
    assert done.status == 0, done.out + done.err
    assert {"walker"} <= swarm.units("epuck-pi").keys()
    assert "epuck" not in swarm.units("epuck-pi")
    assert swarm.swarmctl("status", spec=renamed).status == 0
    with swarm.publishing(LEADER, "walker", 0.05) as publisher:
        until(lambda: moves(swarm.robot("epuck")), "it does not obey by its new name")
        publisher.kill()
    assert swarm.plan(renamed).status == 0


@pytest.mark.slow
def test_leader_to_central_restarts_drivers_a_moved_master_everything(
    swarm: LabSwarm,
) -> None:
    before = swarm.pids()
    same = swarm.variant(
        "central", ("mode: leader", "mode: central"), ("leader: koala-laptop", "hub: koala-laptop")
    )
    run = swarm.deploy(same)
    assert run.status == 0, run.out + run.err
    assert changed(before, swarm.pids()) == {"koala-laptop:koala", "k3-pi:k3", "epuck-pi:epuck"}
    moved = swarm.variant("moved", ("mode: leader", "mode: central"), ("leader: koala-laptop", "hub: k3-pi"))
    run = swarm.deploy(moved)
    assert run.status == 0, run.out + run.err
    assert changed(before, swarm.pids()) == {
        "koala-laptop:master", "koala-laptop:koala", "k3-pi:master", "k3-pi:k3", "epuck-pi:epuck",
    }  # fmt: skip
    assert "master" not in swarm.units("koala-laptop")
    with swarm.driving(LEADER, "epuck", 0.05):
        assert swarm.robot("epuck")["v"] == pytest.approx(0.05, rel=0.05)
    swarm.seconds_to_standstill("epuck")
