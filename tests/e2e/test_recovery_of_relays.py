"""Recovery: whatever ends or is cut off, commands cross a relay again without a person, and no old ones do.

Meanwhile the robot stands, and `status` names the cause.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.e2e.dead_man import Watch, from_within
from tests.e2e.lab_needs import skip_without_wheels
from tests.e2e.lab_swarm import LabSwarm, lab_of, moves, quoted, until
from tests.e2e.recovery import LONGEST, standing, whole
from tests.e2e.security_level import pinned, secured_spec
from tests.timing import Promise

pytestmark = pytest.mark.slow
SPEC = Path(__file__).with_name("relay-recovery.yaml")
DESK, PI, ROVER = "desk", "pi", "rover"
BRIDGE = f"bridge /rover/cmd_vel from {DESK} to {PI}"
RELAY, COMMANDER = "swarm-newswarm.multimaster.service", "swarm-newswarm.commander.service"
STANDS = 0.9  # s, promised by docs/dead-man.md
FILES = {  # of the commander's package, in /opt/ros/jazzy; SIGUSR1 silences it, or lets it speak again
    "share/ament_index/resource_index/packages/commands": "",
    "share/commands/package.xml": """<package format="3"><name>commands</name><version>1.0.0</version>
<description>drives</description><maintainer email="a@b.example">a</maintainer><license>BSD</license>
</package>""",
    "lib/commands/commander": """#!/usr/bin/env python3
import signal, time, rclpy
from geometry_msgs.msg import Twist
speaks = [True]
signal.signal(signal.SIGUSR1, lambda *_: speaks.append(not speaks.pop()))
rclpy.init()
publisher = rclpy.create_node("commander").create_publisher(Twist, "/rover/cmd_vel", 1)
command = Twist()
command.linear.x = 0.1
while True:
    if speaks[0]:
        publisher.publish(command)
    time.sleep(0.1)
""",
}


@pytest.fixture(scope="module")
def swarm(workplace: Path) -> Iterator[LabSwarm]:
    """A lab of two islands; a program on one of them drives the robot of the other."""
    skip_without_wheels(SPEC)
    folder = workplace / "rec-relay"
    folder.mkdir()
    with lab_of(f"rec-rel-{os.getpid()}", secured_spec(SPEC, folder), folder) as swarm:
        for name, text in FILES.items():
            swarm.shell(DESK, f"printf %s {quoted(text)} | sudo install -D /dev/stdin /opt/ros/jazzy/{name}")
        pinned(swarm)
        run = swarm.deploy()
        assert run.status == 0, run.out + run.err
        yield swarm


Happens = Callable[[LabSwarm], AbstractContextManager[float]]  # entered with its moment, undone on leaving


def signal_to(host: str, unit: str, name: str) -> Happens:
    @contextmanager
    def happens(swarm: LabSwarm) -> Iterator[float]:
        yield from_within(swarm, host, f"sudo systemctl kill --kill-whom=main -s {name} {unit}")

    return happens


def without_power(host: str) -> Happens:
    @contextmanager
    def happens(swarm: LabSwarm) -> Iterator[float]:
        moment = time.monotonic()
        swarm.kill(host)
        try:
            yield moment
        finally:
            swarm.start(host)

    return happens


def link_down(seconds: float) -> Happens:
    @contextmanager
    def happens(swarm: LabSwarm) -> Iterator[float]:
        moment = time.monotonic()
        swarm.cut(PI)
        try:
            yield moment
            time.sleep(max(0.0, moment + seconds - time.monotonic()))  # DDS forgets a node after 20 s
        finally:
            swarm.join(PI)

    return happens


@dataclass(frozen=True)
class Fault:
    """``named``: the finding about it. ``lasts``: until it is undone; others end by themselves.

    ``commanded``: the commander goes on meanwhile.
    """

    happens: Happens
    named: str
    lasts: bool = True
    commanded: bool = True


FAULTS: Mapping[str, Fault] = {
    "relay killed": Fault(signal_to(PI, RELAY, "KILL"), f"unit {RELAY} on {PI}", lasts=False),
    "relay hung": Fault(signal_to(PI, RELAY, "STOP"), f"unit {RELAY} on {PI}", lasts=False),
    "relay's host without power": Fault(without_power(PI), f"host {PI}"),
    "its link down 8 s": Fault(link_down(8.0), f"host {PI}"),
    "its link down 25 s": Fault(link_down(25.0), f"host {PI}"),
    "commander's host without power": Fault(without_power(DESK), f"host {DESK}", commanded=False),
    "commander killed": Fault(
        signal_to(DESK, COMMANDER, "KILL"), "program commander", lasts=False, commanded=False
    ),
}


@contextmanager
def silent(swarm: LabSwarm) -> Iterator[None]:
    """The commander lives, sends nothing, and nobody moves."""
    with signal_to(DESK, COMMANDER, "USR1")(swarm):
        swarm.seconds_to_standstill(ROVER)
        with standing(swarm):
            yield
    with signal_to(DESK, COMMANDER, "USR1")(swarm):
        pass


#: `make test-all` runs these as well.
SLOW = ("its link down 8 s", "commander's host without power")


@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=pytest.mark.slow) if one in SLOW else one for one in FAULTS]
)
def test_commands_cross_again_and_no_old_ones(swarm: LabSwarm, name: str, promise: Promise) -> None:
    fault = FAULTS[name]
    with ExitStack() as quiet:
        with ExitStack() as lasting:
            with Watch(swarm.name) as watch:
                until(lambda: moves(swarm.robot(ROVER)), "it is not driven")
                time.sleep(0.3)
                moment = lasting.enter_context(fault.happens(swarm))
                stop = watch.stops(moment)[ROVER]
            found = swarm.findings("--window", "0.5")
            assert {fault.named, *[BRIDGE] * fault.lasts} <= found.keys()
            if fault.commanded:
                quiet.enter_context(silent(swarm))
        over = time.monotonic() if fault.lasts else moment
        whole(swarm, swarm.spec)
    until(lambda: moves(swarm.robot(ROVER)), "it is not driven again")
    promise(f"{name}: until the robot stands", stop.seconds - stop.withheld, STANDS)
    promise(f"{name}: until healthy and driven again", time.monotonic() - over, LONGEST)
