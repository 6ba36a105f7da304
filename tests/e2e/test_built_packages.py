"""Packages in C++ in a lab: built once by a builder, delivered to every host; what changes travels alone."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.e2e.lab_swarm import LabSwarm, Note, SshError, lab_of, quoted, until

TALK = """<package format="2"><name>talk</name><version>1.0.0</version><description>d</description>
<maintainer email="a@b.example">a</maintainer><license>MIT</license>
<buildtool_depend>catkin</buildtool_depend></package>
"""
CMAKE = (
    "cmake_minimum_required(VERSION 3.0)\nproject(talk)\nfind_package(catkin REQUIRED)\ncatkin_package()\n"
)
SAY = """#!/usr/bin/env python3
import pathlib, sys, time
print("{0}")
if "--stay" in sys.argv:
    pathlib.Path("/home/robot/talk").write_text("{0}")
    time.sleep(1000)
"""
FIND = 'from roslib.packages import find_node\nprint(*find_node("talk", "say.py"))\n'
HERE = Path(__file__).with_name("built_packages")


@pytest.fixture(scope="module")
def swarm(workplace: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[LabSwarm]:
    folder = workplace / "built"
    folder.mkdir()
    shutil.copytree(HERE / "src", folder / "src")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
        with lab_of(f"built-{os.getpid()}", HERE / "swarm.yaml", folder) as lab:
            yield lab


def goal(swarm: LabSwarm, namespace: str) -> str:
    """The next message of a node, read by a terminal of another host than the node's."""
    host = "pi" if namespace == "there" else "laptop"
    command = f". /opt/swarm/built/current/setup.bash && timeout 10 rostopic echo -n 1 /{namespace}/goal/x"
    try:
        return swarm.shell(host, f"bash -c '{command}'").split("\n")[0]
    except SshError:
        return ""


def test_a_package_is_built_once_for_all_hosts(swarm: LabSwarm, note: Note) -> None:
    refused = swarm.swarmctl("deploy")
    assert "nav is not built for it" in refused.out
    assert refused.status == 3
    done = swarm.swarmctl("prepare", "--yes")
    assert done.status == 0, done.out + done.err
    assert done.err.count("building nav") == 1
    note("prepare: a roscpp package with a message, built", f"{done.seconds:.1f} s", "")
    again = swarm.swarmctl("prepare", "--yes")
    assert (again.status, again.out.count("nothing to do")) == (0, 2)


def test_both_hosts_run_the_build(swarm: LabSwarm) -> None:
    run = swarm.deploy()
    assert run.status == 0, run.out + run.err
    for program in ("there", "here"):
        until(lambda name=program: goal(swarm, name) == "1.5", f"no goal of {program}")  # type: ignore[misc]
    assert "src/planner.cpp" not in swarm.shell("pi", "find /opt/swarm/built/current/packages -type f")


def test_one_changed_line_delivers_one_library(swarm: LabSwarm, note: Note) -> None:
    source = swarm.folder / "src/nav/src/planner.cpp"
    source.write_text(source.read_text().replace("1.5", "2.5"))
    assert "nav is not built for it" in swarm.plan().out
    done = swarm.swarmctl("prepare", "--yes")
    assert done.status == 0, done.out + done.err
    note("prepare: one changed line of it, built", f"{done.seconds:.1f} s", "")
    steps = swarm.steps()
    assert {kind: target for kind, target, _ in steps["pi"] if kind != "activate"} == {
        "update": "built/lib/libplanner.so",
        "restart": "swarm-built.here.service",
    }
    assert swarm.deploy().status == 0
    until(lambda: goal(swarm, "here") == "2.5", "the old node still runs")


def test_an_error_of_the_compiler_is_shown_with_its_line(swarm: LabSwarm) -> None:
    source = swarm.folder / "src/nav/src/planner.cpp"
    before = source.read_text()
    source.write_text(f"// a comment\n{before.replace('2.5', 'speed')}")
    done = swarm.swarmctl("prepare", "--yes")
    source.write_text(before)
    assert done.status != 0
    assert "the build failed: src/nav/src/planner.cpp:2:" in done.out
    assert "'speed' was not declared" in done.out
    assert "/opt/swarm/built/build/log" in done.out
    assert swarm.plan().status == 0


def test_a_full_disk_of_the_builder_is_named(swarm: LabSwarm) -> None:
    source = swarm.folder / "src/nav/src/planner.cpp"
    before = source.read_text()
    source.write_text(f"// another comment\n{before}")
    place = "/opt/swarm/built/build"
    swarm.shell("laptop", f"sudo mount -t tmpfs -o size=600k,mode=755 tmpfs {place}")
    try:
        done = swarm.swarmctl("prepare", "--yes")
    finally:
        swarm.shell("laptop", f"sudo umount {place}")
        source.write_text(before)
    assert done.status == 3
    assert "the build failed: the disk is full: " in done.out
    assert f"KiB free in {place}" in done.out
    assert f"free space in {place}, then run the same again" in done.out
    assert not list((swarm.folder / "cache").glob("swarmctl/builds/.*"))
    assert "not built" not in swarm.plan().out


def test_a_workspace_of_the_host_does_not_hide_what_is_delivered(swarm: LabSwarm) -> None:
    """The host has another `talk`, built in a workspace: roslaunch and rosrun take the delivered one."""
    files = {"package.xml": TALK, "CMakeLists.txt": CMAKE, "say.py": SAY.format("workspace")}
    for path, text in files.items():
        swarm.shell("pi", f"mkdir -p ws/src/talk; printf %s {quoted(text)} > ws/src/talk/{path}")
        (swarm.folder / "src/talk").mkdir(exist_ok=True)
        (swarm.folder / "src/talk" / path).write_text(text.replace("workspace", "delivered"))
    swarm.shell("pi", "chmod +x ws/src/talk/say.py; catkin_make -C ws", timeout=120)
    (swarm.folder / "src/talk/say.py").chmod(0o755)
    say = "  say: {host: pi, package: talk, executable: say.py, args: [--stay], params: {a: 1}}\n"
    spec = swarm.variant(
        "ws",
        ("  pi: {", "  pi: {workspaces: [/home/robot/ws], "),
        ("packages:\n", "packages:\n  talk: {from: ./src/talk}\n"),
        ("programs:\n", f"programs:\n{say}"),
    )
    done = swarm.deploy(spec)
    assert done.status == 0, done.out + done.err
    until(lambda: swarm.shell("pi", "cat talk 2>/dev/null || true") == "delivered", "the other one runs")
    # Without the space of the release the other one is found.
    setup = ". /opt/swarm/built/current/setup.bash; python3 find.py"
    without = "export CMAKE_PREFIX_PATH=${CMAKE_PREFIX_PATH#*:}; python3 find.py"
    swarm.shell("pi", f"printf %s {quoted(FIND)} > find.py")
    found = swarm.shell("pi", f"bash -c {quoted(f'{setup}; {without}')}")
    delivered, hidden = found.splitlines()
    assert delivered == "/opt/swarm/built/current/packages/talk/say.py"
    assert hidden.split()[0] == "/home/robot/ws/src/talk/say.py"


def test_a_build_for_another_platform_is_refused(swarm: LabSwarm) -> None:
    release = "sudo sed -i s/^VERSION_ID=.*/VERSION_ID=13/ /usr/lib/os-release"
    swarm.shell("pi", release)
    assert "it is debian-13-x86_64-ros-" in swarm.plan().out
    assert "its packages are built for debian-12-x86_64-ros-" in swarm.plan().out
    done = swarm.swarmctl("prepare", "--yes")
    assert done.status != 0
    assert "a build of nav for debian-13-x86_64-ros-" in done.out
    assert "name a host of debian-13-x86_64-ros-" in done.out
    swarm.shell("pi", release.replace("=13", '=\\"12\\"'))


OPT = """\
version: 1
name: opt
mode: central
hub: pi
hosts:
  laptop: {address: 192.168.77.10, user: robot}
  pi: {address: 192.168.77.11, user: robot}
robots:
  k3: {type: khepera3, host: pi}
links:
  - {kind: ethernet, name: lab, hosts: [laptop, pi]}
  - {kind: serial, host: pi, robot: k3, usb: {serial: FTDI1234}}
programs:
  odometry: {host: pi, command: [rostopic, echo, /k3/odom]}
  out: {host: pi, package: rosout, executable: rosout, namespace: second}
"""


@pytest.fixture(scope="module")
def opt(swarm: LabSwarm) -> Path:
    """The spec of a swarm whose hub, with the robot, has its ROS in /opt/ros/noetic alone."""
    removed = swarm.swarmctl("remove", "--yes")
    assert removed.status == 0, removed.out + removed.err
    text = Path(__file__).with_name("opt_ros.py").read_text()
    swarm.shell("pi", f"printf %s {quoted(text)} >opt_ros.py; sudo python3 opt_ros.py", timeout=120)
    with pytest.raises(SshError, match="No module named 'rospy'"):
        swarm.shell("pi", "env -i python3 -c 'import rospy'")
    spec = swarm.folder / "opt.yaml"
    spec.write_text(OPT)
    return spec


@pytest.mark.slow
def test_a_robot_drives_on_a_host_with_its_ros_in_opt(swarm: LabSwarm, opt: Path) -> None:
    """Master, driver, programs, status and terminals find it, and nothing is left where Debian has it."""
    done = swarm.deploy(opt)
    assert done.status == 0, done.out + done.err
    until(lambda: swarm.swarmctl("status", spec=opt).status == 0, "the swarm is not healthy")
    nodes = swarm.shell("pi", "bash -c '. /opt/swarm/opt/current/setup.bash; which rosnode; rosnode list'")
    assert nodes.split()[0] == "/opt/ros/noetic/bin/rosnode"
    assert "/second/out" in nodes.split()
    place = swarm.robot("k3")["distance"]
    command = "timeout 20 rostopic pub -r 10 /k3/cmd_vel geometry_msgs/Twist '{linear: {x: 0.1}}'"
    source = ". /opt/swarm/opt/current/setup.bash"
    swarm.shell("pi", f"bash -c {quoted(f'{source}; {command} >/dev/null 2>&1 &')}")
    until(lambda: swarm.robot("k3")["distance"] > place + 0.1, "the robot does not drive")


@pytest.mark.slow
def test_a_full_disk_stops_its_host_alone(swarm: LabSwarm, opt: Path) -> None:
    spec = swarm.folder / "moved.yaml"
    spec.write_text(OPT.replace("odometry: {host: pi", "odometry: {host: laptop"))
    swarm.shell("pi", "sudo mount -t tmpfs -o size=900k,mode=755 tmpfs /opt/swarm")
    try:
        done = swarm.swarmctl("deploy", spec=spec)
    finally:  # the agent may need a moment to end after its answer
        unmount = "sudo umount /opt/swarm 2>/dev/null && exit"
        swarm.shell("pi", f"for n in $(seq 50); do {unmount}; sleep 0.2; done; exit 1")
    assert done.status != 0
    assert "refused: the disk is full: " in done.out
    assert "KiB free in /opt/swarm, " in done.out
    assert "help: free " in done.out
    assert "1 of 2 hosts changed; failed: pi" in done.out
    assert "odometry" in swarm.shell("laptop", "ls /opt/swarm/opt/current/units")
