"""Packages that have to be built: which build a host needs, who makes it, and what a release has of it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from swarm_onboard.agent.verbs.observe import Facts

from swarmctl.plan.host_builds import builds_of, keys_of, planned
from swarmctl.plan.host_needs import package_needs
from swarmctl.plan.host_preparation import HostPreparation
from swarmctl.plan.observed_host import NOTHING
from swarmctl.plan.reconcile import reconcile
from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from swarmctl.swarm.resolved import Swarm
from tests import ROOT
from tests.loading import load_swarm

SPEC = ROOT / "tests/e2e/built_packages/swarm.yaml"
DEBIAN, UBUNTU = "debian-12-x86_64-ros-1.15.15", "ubuntu-20.04-aarch64-noetic-1.16.0"
ALL = {"laptop": DEBIAN, "pi": DEBIAN}
BUILT = {"lib/nav/nav_node": (b"#!/bin/sh\n", True), "lib/libplanner.so": (b"1", False)}


@pytest.fixture(scope="module")
def swarm() -> Swarm:
    found, wrong = load_swarm(SPEC)
    assert found is not None, wrong
    return found


def edited(swarm: Swarm, path: str, content: bytes) -> Swarm:
    nav = swarm.packages["nav"]
    return replace(swarm, packages={"nav": replace(nav, files={**nav.files, path: (content, False)})})


def on(swarm: Swarm, platform: str, **built: object) -> Swarm:
    hosts = {name: replace(host, platform=platform) for name, host in swarm.hosts.items()}
    key = keys_of(swarm, "pi", platform)["nav"]
    return replace(swarm, hosts=hosts, builds={key: BUILT})


def test_hosts_of_one_platform_share_one_build(swarm: Swarm) -> None:
    (build,), problems = builds_of(swarm, ALL, (), tuple(ALL))
    assert not problems
    assert (build.builder, build.platform, build.hosts) == ("laptop", DEBIAN, ("laptop", "pi"))
    assert [step.cause for step in build.steps] == [f"packages.nav, for laptop, pi ({DEBIAN})"]
    assert builds_of(swarm, ALL, build.keys.values(), tuple(ALL)) == ((), {})


def test_a_platform_without_a_builder_is_named(swarm: Swarm) -> None:
    (build,), problems = builds_of(swarm, {**ALL, "pi": UBUNTU}, (), tuple(ALL))
    assert build.hosts == ("laptop",)
    assert problems["pi"].message == f"a build of nav for {UBUNTU}"
    assert problems["pi"].hint == f"name a host of {UBUNTU} under `ros.builders`; laptop is none"


def test_a_builder_shows_what_it_builds_for_a_host_without_ros_too(swarm: Swarm) -> None:
    """It builds for the ROS that the host gets first."""
    bare = DEBIAN.replace("-ros-1.15.15", "")
    builds, _ = builds_of(swarm, {"laptop": DEBIAN, "pi": bare}, (), tuple(ALL))
    laptop, pi = planned([HostPreparation("laptop"), HostPreparation("pi")], builds, {})
    assert [step.cause for step in laptop.steps] == [
        f"packages.nav, for laptop ({DEBIAN})",
        f"packages.nav, for pi ({bare})",
    ]
    assert not pi.steps


def test_a_host_with_another_ros_gets_no_build_of_the_builder(swarm: Swarm) -> None:
    newer = DEBIAN.replace("1.15.15", "1.16.0")
    (build,), problems = builds_of(swarm, {"laptop": DEBIAN, "pi": newer}, (), tuple(ALL))
    assert build.hosts == ("laptop",)
    assert f"the builder laptop is {DEBIAN}" in problems["pi"].hint
    assert keys_of(swarm, "pi", newer) != keys_of(swarm, "pi", DEBIAN)
    assert problem_of(bundles(on(swarm, DEBIAN))["pi"], newer).startswith(f"it is {newer}")
    bare = DEBIAN.replace("-ros-1.15.15", "")
    for platforms in ({"laptop": DEBIAN, "pi": bare}, {"laptop": bare, "pi": DEBIAN}):
        assert not builds_of(swarm, platforms, (), tuple(ALL))[1]  # ROS is installed first


def test_a_builder_that_is_not_selected_builds_nothing(swarm: Swarm) -> None:
    builds, problems = builds_of(swarm, ALL, (), ["pi"])
    assert not builds
    assert "include the builder laptop" in problems["pi"].hint


def test_sources_dependencies_and_platform_name_a_build(swarm: Swarm) -> None:
    known = keys_of(swarm, "pi", DEBIAN)
    assert keys_of(swarm, "laptop", DEBIAN) == known
    assert keys_of(swarm, "pi", UBUNTU) != known
    assert keys_of(edited(swarm, "src/planner.cpp", b"//"), "pi", DEBIAN) != known
    nav = swarm.packages["nav"]
    other = replace(nav, name="msgs", files={"a": (b"1", False)})
    both = replace(swarm, packages={"nav": replace(nav, depends=frozenset({"msgs"})), "msgs": other})
    changed = replace(both, packages={**both.packages, "msgs": replace(other, files={"a": (b"2", False)})})
    unused = replace(swarm, packages={**swarm.packages, "msgs": other})
    assert len({keys_of(one, "pi", DEBIAN)["nav"] for one in (swarm, both, changed)}) == 3
    assert keys_of(unused, "pi", DEBIAN) == known


def test_a_release_has_the_build_and_no_sources_of_it(swarm: Swarm) -> None:
    bundle = bundles(on(swarm, DEBIAN))["pi"]
    files = {file.path: file for file in bundle.files}
    assert files["built/lib/nav/nav_node"].mode == 0o755
    assert files["built/.catkin"].content == b"/opt/swarm/built/current/packages"
    assert "packages/nav/msg/Goal.msg" in files
    assert not [path for path in files if path.endswith((".cpp", "CMakeLists.txt"))]
    (unit,) = [unit for unit in bundle.units if unit.program == "here"]
    assert {"built/lib/libplanner.so", "packages/nav/msg/Goal.msg"} <= set(unit.needs)
    assert 'SWARM_BUILT="/opt/swarm/built/current/built"\n' in files["env/ros.env"].content.decode()
    assert (bundle.platform, bundle.unbuilt) == (DEBIAN, ())


def problem_of(bundle: Bundle, platform: str = "") -> str:
    facts = Facts("pi", "x86_64", "3.8.10", True, 0, "b", 0.0, 1, 1, {}, [], platform, None, None)
    observed = replace(NOTHING, facts=facts) if platform else NOTHING
    found = reconcile(bundle, observed).problem
    return found.message if found else ""


def test_a_plan_refuses_what_is_not_built_for_the_host(swarm: Swarm) -> None:
    assert problem_of(bundles(swarm)["pi"]) == "nav is not built for it"
    bundle = bundles(on(swarm, DEBIAN))["pi"]
    assert problem_of(bundle) == ""
    assert problem_of(bundle, UBUNTU) == f"it is {UBUNTU}, and its packages are built for {DEBIAN}"
    assert "lacks" in problem_of(bundle, DEBIAN)  # what is left has to do with programs


def test_a_builder_needs_compilers_and_what_packages_name(swarm: Swarm) -> None:
    laptop, pi = (
        {need.key or need.packages[0]: need for need in package_needs(swarm, swarm.hosts[host])}
        for host in ("laptop", "pi")
    )
    assert set(pi) == {"roscpp", "std_msgs", "message_runtime"}
    assert set(laptop) == {*pi, "g++", "make", "catkin", "rosgraph", "message_generation"}
    assert laptop["catkin"].packages == (
        "ros-noetic-catkin",
        "libcatkin-dev",
        "python3-catkin",
        "ros-catkin",
        "catkin",
    )
    assert pi["roscpp"].entries == ("packages.nav",)


def test_keys_that_the_spec_skips_are_no_needs(swarm: Swarm) -> None:
    nav = replace(swarm.packages["nav"], skip_keys=frozenset({"std_msgs", "roscpp"}))
    needs = package_needs(replace(swarm, packages={"nav": nav}), swarm.hosts["pi"])
    assert [need.key for need in needs] == ["message_runtime"]
