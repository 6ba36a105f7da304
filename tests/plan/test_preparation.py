"""What makes a host fit: only what it lacks, each with who needs it, in an order that works."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from swarm_onboard.agent.accounts import AccountState
from swarm_onboard.agent.images import Image
from swarm_onboard.agent.verbs.inventory import Answer
from swarm_onboard.agent.verbs.observe import Facts

from swarmctl.plan.host_needs import ACCOUNT_GROUPS, HostNeeds, PackageRequirement, needs_of
from swarmctl.plan.host_preparation import HostPreparation, preparation
from swarmctl.render.build_bundle import bundles
from swarmctl.views.preparation import PreparationView
from tests import ROOT
from tests.loading import load_swarm

SPEC = """\
version: 1
name: lab
mode: central
hub: laptop
ros: {workspace: /home/robot/ws}
hosts:
  laptop: {address: 192.168.77.10, install: {apt: [htop]}}
  pi: {address: 192.168.77.11, user: robot, workspaces: [/home/robot/nav_ws, /home/robot/ws]}
robots:
  k3: {type: khepera3, host: pi}
links:
  - {kind: wlan, name: lab, hosts: [laptop, pi]}
  - {kind: serial, host: pi, robot: k3, usb: {serial: FTDI1234}}
programs:
  map: {host: pi, package: gmapping, executable: slam_gmapping, install: {pip: [numpy==1.24.4]}}
  view: {host: laptop, package: rviz, executable: rviz, optional: true}
"""
NEEDS = HostNeeds(
    "lab", "pi", "robot", "noetic",
    packages=(
        PackageRequirement("package:joy", ("ros-noetic-joy", "python3-joy"), ("programs.joystick",)),
        PackageRequirement("chronyd", ("chrony",), ("time",)),
    ),
    pip={"numpy==1.24.4": ("programs.map.install",)},
    groups={"dialout": ("robots.k3",)},
    workspaces={"/home/robot/ws": ("ros.workspace",)},
)  # fmt: skip
HAS = {"package:joy": "/opt/ros/noetic/share/joy", "chronyd": "/usr/sbin/chronyd"}
FACTS = Facts("pi", "armv7l", "3.8.10", True, 0, "b", 0.0, 1, 1, HAS, [], "", None, None)
ACCOUNT = AccountState(exists=True, keys=True, sudo=True, groups=["robot", "dialout"])
FIT = Answer(
    FACTS,
    debian={},
    pip={"numpy==1.24.4": "1.24.4"},
    account=ACCOUNT,
    groups=["dialout"],
    workspaces={"/home/robot/ws": "built"},
    rosdep={},
    sources=["archive.ubuntu.com"],
    images=[],
    wireless=[],
)


def planned(login: str = "", *, refreshed: bool = False, **changes: Any) -> HostPreparation:
    return preparation(NEEDS, FIT._replace(**changes), login=login, refreshed=refreshed)


def lines(plan: HostPreparation) -> list[str]:
    return [f"{step.kind.value} {step.target}: {step.cause}" for step in plan.steps]


def lacking(*names: str) -> Facts:
    return FACTS._replace(has={**HAS, **dict.fromkeys(names)})


@pytest.fixture(scope="module")
def needs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, HostNeeds]:
    path = tmp_path_factory.mktemp("spec") / "swarm.yaml"
    path.write_text(SPEC)
    swarm, found = load_swarm(path)
    assert swarm is not None, found
    made = bundles(swarm)
    return {name: needs_of(swarm, host, made[name]) for name, host in swarm.hosts.items()}


def test_a_spec_names_who_needs_what(needs: dict[str, HostNeeds]) -> None:
    found = {need.requirement: need.entries for need in needs["pi"].packages}
    assert found["rospy"] == ("robots.k3",)
    assert found["package:gmapping"] == ("programs.map",)
    assert found["chronyd"] == ("time",)
    assert "roscore" not in found
    assert needs["pi"].pip == {"numpy==1.24.4": ("programs.map.install",)}
    assert needs["pi"].groups["dialout"] == ("robots.k3", "programs.map")
    assert needs["laptop"].workspaces == {"/home/robot/ws": ("ros.workspace",)}
    assert needs["pi"].workspaces == dict.fromkeys(
        ("/home/robot/nav_ws", "/home/robot/ws"), ("hosts.pi.workspaces",)
    )


def test_optional_programs_are_provided_for_too(needs: dict[str, HostNeeds]) -> None:
    found = {need.requirement: need for need in needs["laptop"].packages}
    assert found["package:rviz"].entries == ("programs.view",)
    assert found["package:rviz"].packages[0] == "ros-noetic-rviz"
    assert found[""].packages == ("htop",)
    assert found[""].entries == ("hosts.laptop.install",)


def test_every_group_of_a_unit_is_provided_for() -> None:
    units = (ROOT / "templates").glob("*/*.j2")
    named = {
        group
        for unit in units
        for line in Path(unit).read_text().splitlines()
        if line.startswith("SupplementaryGroups=")
        for group in line.partition("=")[2].split()
    }
    assert named == set(ACCOUNT_GROUPS)


def test_a_fit_host_has_nothing_to_do() -> None:
    assert planned().fit


def test_what_to_set_on_a_robot_is_noted_of_a_fit_host() -> None:
    found = preparation(replace(NEEDS, by_hand=("robot a runs nodes itself",)), FIT)
    assert found.fit
    assert PreparationView().text([found]).plain == "nothing to do\n\nnote: pi: robot a runs nodes itself"


def test_the_package_that_apt_has_is_chosen() -> None:
    states = {"ros-noetic-joy": "unknown", "python3-joy": "available"}
    plan = planned(facts=lacking("package:joy"), debian=states)
    assert lines(plan) == ["apt python3-joy: programs.joystick"]


def test_the_lists_are_refreshed_before_a_package_is_missing() -> None:
    plan = planned(facts=lacking("package:joy"))
    assert lines(plan) == ["refresh lists of packages: apt does not know ros-noetic-joy yet"]
    assert not plan.lacks
    (lack,) = planned(facts=lacking("package:joy"), refreshed=True).lacks
    assert "no package source of the host has ros-noetic-joy or python3-joy" in lack.message
    assert "programs.joystick" in lack.message


def test_a_package_that_does_not_bring_it_is_named() -> None:
    states = {"ros-noetic-joy": "installed"}
    (lack,) = planned(facts=lacking("package:joy"), debian=states, refreshed=True).lacks
    assert "ros-noetic-joy is installed and does not bring it" in lack.message


def test_a_fresh_host_gets_its_account_first() -> None:
    nobody = AccountState(exists=False, keys=False, sudo=False, groups=[])
    plan = planned(
        "pi",
        account=nobody,
        facts=lacking("chronyd"),
        debian={"chrony": "available"},
        workspaces={"/home/robot/ws": "sources"},
    )
    assert lines(plan) == [
        "account robot: hosts.pi.user",
        "keys robot: those of pi",
        "sudo robot: a deploy writes units",
        "group dialout: robots.k3",
        "apt chrony: time",
        "build /home/robot/ws: ros.workspace: its sources are not built",
    ]


@pytest.mark.parametrize(
    ("change", "step"),
    [
        ({"pip": {"numpy==1.24.4": "1.19.0"}}, "pip numpy==1.24.4: programs.map.install"),
        ({"groups": []}, "group dialout: robots.k3"),
        ({"account": ACCOUNT._replace(groups=["robot"])}, "group dialout: robots.k3"),
    ],
)
def test_each_difference_is_one_step(change: dict[str, Any], step: str) -> None:
    assert lines(planned(**change)) == [step]


def test_a_workspace_without_sources_is_for_a_person() -> None:
    plan = planned(workspaces={"/home/robot/ws": "absent"})
    assert not plan.steps
    assert "/home/robot/ws/src" in plan.lacks[0].hint


def test_no_step_helps_a_host_without_systemd() -> None:
    plan = planned(facts=FACTS._replace(systemd=False))
    assert plan.problem is not None
    assert "systemd" in plan.problem.message


@pytest.mark.parametrize(
    ("found", "debian", "by_rosdep", "steps"),
    [
        ("/opt/ros/noetic/share/std_msgs", {}, {}, []),
        (
            None,
            {"libstd-msgs-dev": "available", "ros-std-msgs": "available"},
            {},
            ["libstd-msgs-dev"],
        ),
        (None, {"libstd-msgs-dev": "installed", "ros-std-msgs": "available"}, {}, []),
        (
            None,
            {"ros-noetic-other": "available"},
            {"std_msgs": ["ros-noetic-other"]},
            ["ros-noetic-other"],
        ),
        (None, {"libstd-msgs-dev": "available"}, {"std_msgs": []}, []),
    ],
)
def test_a_key_of_a_package_is_what_the_host_knows_by_it(
    found: str | None, debian: dict[str, str], by_rosdep: dict[str, list[str]], steps: list[str]
) -> None:
    candidates = ("ros-noetic-std-msgs", "libstd-msgs-dev", "ros-std-msgs")
    need = PackageRequirement("package:std_msgs", candidates, ("packages.nav",), "std_msgs")
    facts = FACTS._replace(has={"package:std_msgs": found})
    answer = FIT._replace(facts=facts, debian=debian, rosdep=by_rosdep)
    plan = preparation(replace(NEEDS, packages=(need,)), answer, refreshed=True)
    assert lines(plan) == [f"apt {name}: packages.nav" for name in steps]
    assert not plan.lacks


def test_a_key_that_nobody_knows_can_be_skipped() -> None:
    need = PackageRequirement("package:lost", ("ros-noetic-lost",), ("packages.nav",), "lost")
    answer = FIT._replace(rosdep={})
    (problem,) = preparation(replace(NEEDS, packages=(need,)), answer, refreshed=True).lacks
    assert "lost, needed by packages.nav" in problem.message
    assert "`skip_keys: [lost]` to packages.nav" in problem.hint


@pytest.mark.parametrize(
    ("platform", "sources", "kinds"),
    [
        ("ubuntu-20.04-aarch64", [], ["source packages.ros.org", "refresh lists of packages"]),
        ("ubuntu-20.04-aarch64", ["packages.ros.org"], ["refresh lists of packages"]),
        ("debian-12-x86_64", [], ["refresh lists of packages"]),
    ],
)
def test_a_fresh_ubuntu_gets_the_source_of_ros(platform: str, sources: list[str], kinds: list[str]) -> None:
    facts = lacking("package:joy")._replace(platform=platform)
    plan = planned(facts=facts, sources=sources)
    assert [f"{step.kind.value} {step.target}" for step in plan.steps] == kinds
    assert not planned(facts=facts, sources=sources, refreshed=True).steps


IMAGE, OWN = "docker.io/library/ros@sha256:" + "1" * 64, "sha256:" + "2" * 64


def test_images_are_pulled_after_their_engine() -> None:
    needs = HostNeeds(
        "lab", "pi", "robot", "noetic",
        packages=(PackageRequirement("podman", ("podman",), ("programs.see",)),),
        images={("podman", IMAGE): ("programs.see",), ("podman", OWN): ("programs.own",)},
    )  # fmt: skip
    absent = Image(there=False, built_for="", machine="x86_64", error="")
    answer = FIT._replace(debian={"podman": "available"}, images=[absent, absent])
    plan = preparation(needs, answer)
    assert lines(plan) == ["apt podman: programs.see", f"pull podman {IMAGE}: programs.see"]
    (problem,) = plan.lacks  # no registry has one that is pinned by its ID
    assert problem.hint == f"copy it: `podman save {OWN} | ssh pi sudo podman load`"
    there = absent._replace(there=True)
    facts = FACTS._replace(has={"podman": "/usr/bin/podman"})
    assert preparation(needs, FIT._replace(facts=facts, images=[there, there])).fit


def test_a_host_without_a_radio_needs_no_iw() -> None:
    needs = replace(NEEDS, packages=(PackageRequirement("iw", ("iw",), ("links.0",)),))
    answer = FIT._replace(debian={"iw": "unknown"})
    assert preparation(needs, answer, refreshed=True).fit
    assert not preparation(needs, answer._replace(wireless=["wlan0"]), refreshed=True).fit
