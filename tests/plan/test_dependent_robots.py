"""Which robots in use lose their commander, master or bridge with a unit that stops, in each mode."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest
from swarm_onboard.agent.motion_gate import RobotUse

from swarmctl.plan.robots_in_use import Dependents, problems
from tests.loading import load_swarm

BODY = """
hosts:
  laptop: {address: 192.168.77.10}
  k3-pi: {address: 192.168.77.11}
  epuck-pi: {address: 192.168.77.12, bluetooth: [hci0]}
robots:
  koala: {type: koala, host: laptop}
  k3: {type: khepera3, host: k3-pi}
  epuck: {type: epuck, host: epuck-pi}
links:
  - {kind: wlan, name: lab, hosts: [laptop, k3-pi, epuck-pi], multicast: true}
  - {kind: serial, host: laptop, robot: koala, usb: {serial: A600dXyz}}
  - {kind: serial, host: k3-pi, robot: k3, usb: {serial: FTDI1234}}
  - {kind: bluetooth, host: epuck-pi, robot: epuck, mac: "10:00:e8:c5:64:37"}
programs:
  joystick: {host: laptop, use: teleop-joy}
  planner: {host: laptop, package: planner, executable: planner}
  logger: {host: laptop, package: logger, executable: logger}
  nav: {host: laptop, package: nav, launch: nav.launch}
control:
  - {by: joystick, of: [k3, epuck], priority: 2}
  - {by: nav, of: [k3]}
time: {root: laptop}
"""
MODES = {
    "single-minded": "mode: single-minded\nleader: laptop\n",
    "leader": "mode: leader\nleader: laptop\n",
    "central": "mode: central\nhub: k3-pi\n",
    "standalone": "mode: standalone\nmultimaster: {provider: static}\n",
    "fkie": "mode: standalone\nmultimaster: {provider: fkie}\n",
    "combined": """mode: combined
multimaster: {provider: static}
islands:
  big: {mode: leader, leader: laptop, hosts: [laptop, epuck-pi]}
  small: {mode: central, hub: k3-pi, hosts: [k3-pi]}
""",
}
BY_JOYSTICK = "joystick (/joystick)"
BY_NAV = "nav (/nav/move_base)"
BY_LAPTOP = "laptop (/rostopic_7)"  # no `control` names the Koala
BY_OWN = "k3-pi (/k3/wander)"
TURNS = ""  # it moves, and nobody commands it


def swarm_in(mode: str, folder: Path) -> Dependents:
    text = MODES[mode] + BODY
    if mode == "single-minded":  # one computer has all lines
        text = text.replace("host: k3-pi", "host: laptop").replace("host: epuck-pi", "host: laptop")
        text = text.replace("{address: 192.168.77.10}", "{address: 192.168.77.10, bluetooth: [hci0]}")
    path = folder / "swarm.yaml"
    path.write_text(f"version: 1\nname: s\n{text}", "utf-8")
    swarm, found = load_swarm(path)
    assert swarm is not None, [one.message for one in found]
    return Dependents(swarm)


@pytest.mark.parametrize(
    ("mode", "stopped", "robot", "commander", "depends"),
    [
        # A commander: those that it commands at this moment.
        *(
            (mode, "laptop joystick", robot, commander, robot != "koala" and commander == BY_JOYSTICK)
            for mode in MODES
            for robot, commander in [("k3", BY_JOYSTICK), ("epuck", BY_JOYSTICK), ("k3", BY_NAV)]
        ),
        ("leader", "laptop nav", "k3", BY_NAV, True),
        ("leader", "laptop nav", "k3", BY_JOYSTICK, False),
        ("leader", "laptop joystick", "koala", BY_LAPTOP, False),
        ("leader", "laptop planner", "koala", "laptop (/planner)", True),
        ("leader", "laptop logger", "koala", "laptop (/planner)", False),
        ("leader", "laptop nav", "koala", BY_LAPTOP, True),  # its nodes are not known
        ("leader", "laptop nav", "koala", "laptop (/planner)", True),
        ("leader", "laptop gone", "koala", "laptop (/gone)", True),  # a program of the release before
        ("leader", "laptop gone", "k3", BY_JOYSTICK, False),
        # One that moves without a command: all that may have commanded it.
        ("leader", "laptop joystick", "epuck", TURNS, True),
        ("leader", "laptop nav", "epuck", TURNS, False),
        ("central", "laptop planner", "epuck", TURNS, False),
        # A master: the robots of its island, and those commanded from there.
        *((mode, "laptop master", "koala", BY_LAPTOP, True) for mode in ("single-minded", "leader")),
        ("single-minded", "laptop master", "epuck", BY_JOYSTICK, True),
        ("leader", "laptop master", "epuck", BY_JOYSTICK, True),
        ("leader", "laptop master", "k3", TURNS, True),
        ("central", "k3-pi master", "epuck", BY_JOYSTICK, True),
        ("central", "laptop master", "epuck", BY_JOYSTICK, True),  # of an earlier release: unknown, so yes
        ("standalone", "laptop master", "epuck", BY_JOYSTICK, True),
        ("standalone", "epuck-pi master", "epuck", BY_JOYSTICK, True),
        ("standalone", "k3-pi master", "epuck", BY_JOYSTICK, False),
        ("standalone", "laptop master", "k3", BY_OWN, False),
        ("standalone", "k3-pi master", "k3", BY_OWN, True),
        ("combined", "laptop master", "k3", BY_JOYSTICK, True),
        ("combined", "k3-pi master", "epuck", BY_JOYSTICK, False),
        # A bridge: robots whose commands cross it. The static one runs where they arrive, fkie at both ends.
        ("standalone", "epuck-pi multimaster", "epuck", BY_JOYSTICK, True),
        ("standalone", "laptop multimaster", "epuck", BY_JOYSTICK, False),
        ("fkie", "laptop multimaster", "epuck", BY_JOYSTICK, True),
        ("fkie", "k3-pi multimaster", "epuck", BY_JOYSTICK, False),
        ("standalone", "k3-pi multimaster", "k3", BY_OWN, False),
        ("combined", "k3-pi multimaster", "k3", BY_JOYSTICK, True),
        ("combined", "k3-pi multimaster", "epuck", BY_JOYSTICK, False),
        # Units that nothing else needs; a driver's own is guarded on its host.
        ("leader", "k3-pi k3", "k3", BY_JOYSTICK, False),
        ("leader", "epuck-pi epuck.rfcomm", "epuck", BY_JOYSTICK, False),
        ("leader", "k3-pi wlan", "k3", BY_JOYSTICK, False),
    ],
)
def test_a_unit_concerns_the_robots_that_it_serves(
    mode: str, stopped: str, robot: str, commander: str, depends: bool, *, tmp_path: Path
) -> None:
    host, part = stopped.split()
    dependents = swarm_in(mode, tmp_path)
    stops = {host: [f"swarm-s.{part}.service"]}
    assert bool(dependents.in_use(stops, {robot: RobotUse("is in use", commander)})) is depends
    possible = [one for robots in dependents.robots(stops).values() for one in robots]
    assert robot in possible or not depends or part == "gone"


def uses(**commanders: str) -> Mapping[str, RobotUse]:
    return {robot: RobotUse(f"is commanded by {one}", one) for robot, one in commanders.items()}


def test_the_problem_names_robot_commander_and_units(tmp_path: Path) -> None:
    units = ["swarm-s.master.service", "swarm-s.joystick.service"]
    found = swarm_in("leader", tmp_path).in_use({"laptop": units}, uses(epuck=BY_JOYSTICK, koala=BY_LAPTOP))
    assert {host: one.message for host, one in problems(found).items()} == {
        "laptop": "epuck on epuck-pi is commanded by joystick (/joystick), and depends on "
        "swarm-s.master.service, swarm-s.joystick.service; "
        "koala on laptop is commanded by laptop (/rostopic_7), and depends on swarm-s.master.service"
    }
    assert "--stop-robots" in problems(found)["laptop"].hint


def test_of_a_host_that_does_not_answer_every_robot_may_be_in_use(tmp_path: Path) -> None:
    dependents = swarm_in("leader", tmp_path)
    stops = {"laptop": ["swarm-s.joystick.service"]}
    assert dependents.robots(stops) == {"k3-pi": ["k3"], "epuck-pi": ["epuck"]}
    (found,) = dependents.unknown(stops, {"k3-pi": "no route to host"})
    assert str(found) == (
        "k3 on k3-pi may be in use: no route to host, and depends on swarm-s.joystick.service"
    )


@pytest.mark.parametrize("mode", MODES)
def test_what_a_removal_stops_includes_every_unit_that_serves_others(mode: str, tmp_path: Path) -> None:
    dependents = swarm_in(mode, tmp_path)
    stops = {host: dependents.units_on(host) for host in dependents.swarm.hosts}
    found = dependents.in_use(stops, uses(k3=BY_JOYSTICK, epuck=BY_JOYSTICK))
    assert {one.robot.name for one in found} == {"k3", "epuck"}
