"""The dead-man: whatever fails while robots drive, they stand within what docs/dead-man.md promises.

`pytest --regenerate` writes the figures of its run into the page.
"""

from __future__ import annotations

import os
import signal
import time
from base64 import b64encode
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import pytest

from swarmctl.lab import lab
from tests.e2e.dead_man import (
    ROS_1,
    ROS_2,
    Commander,
    Page,
    Stop,
    Watch,
    commanding,
    from_within,
    running,
    signalled,
)
from tests.e2e.lab_needs import skip_without_wheels
from tests.e2e.lab_swarm import (
    HOME,
    LabSwarm,
    lab_of,
    moves,
    until,
)
from tests.timing import Promise

pytestmark = pytest.mark.slow
SPEEDS = {"koala": 0.2, "khepera3": 0.1, "epuck": 0.05, "rover": 0.2}  # m/s
GO_ON = ("koala", "khepera3", "epuck")  # that have no dead-man of their own
LAPTOP, PI = "laptop", "pi"
OUT = 2.0  # s for which a cable or a network is out
KEPT = 6.0  # s within which a network delivers what it has kept
WRITTEN = 100.0  # looks at the robots in a second, at least, where the page gets the figures
RAISE_IN_LOOP = Path(__file__).parents[1] / "onboard/driver/raise_in_loop.py"


@pytest.fixture(scope="class")
def ros(request: pytest.FixtureRequest) -> str:
    return str(request.cls.ROS)


@pytest.fixture(scope="class")
def swarm(workplace: Path, ros: str) -> Iterator[LabSwarm]:
    folder = workplace / f"dead-man-{ros[-1]}"
    folder.mkdir()
    spec = Path(__file__).with_name("dead-man.yaml" if ros == ROS_1 else "dead-man-ros2.yaml")
    if ros == ROS_2:
        skip_without_wheels(spec)
    with lab_of(f"dead{ros[-1]}-{os.getpid()}", spec, folder) as swarm:
        deploy = swarm.deploy()
        assert deploy.status == 0, deploy.out + deploy.err
        yield swarm


@pytest.fixture(scope="class")
def watch(swarm: LabSwarm) -> Iterator[Watch]:
    with Watch(swarm.name) as watch:
        yield watch


def units() -> str:
    return " ".join(f"swarm-newswarm.{robot}" for robot in SPEEDS)


class Scene:
    """All robots drive, commanded by a node on the laptop."""

    def __init__(self, swarm: LabSwarm, watch: Watch, commander: Commander) -> None:
        self.swarm = swarm
        self.watch = watch
        self.commander = commander

    def drivers(self) -> list[int]:
        files = [f"{HOME}/current/params/{robot}.yaml" for robot in SPEEDS]
        return [pid for file in files for pid in running(self.swarm, PI, "--config", file)]

    def all_move(self) -> bool:
        return all(map(moves, self.swarm.robots().values()))

    def left_alone(self) -> None:
        """Those with a dead-man of their own stand by now; the others go on."""
        states = self.swarm.robots()
        assert [robot for robot in SPEEDS if moves(states[robot])] == [*GO_ON]

    def obeyed_again(self) -> None:
        until(self.all_move, "not every robot obeys")


@contextmanager
def driving(swarm: LabSwarm, watch: Watch) -> Iterator[Scene]:
    with commanding(swarm, LAPTOP, SPEEDS) as commander:
        scene = Scene(swarm, watch, commander)
        commander.command(1.0)
        scene.obeyed_again()
        time.sleep(0.3)
        yield scene
    swarm.settle()


@pytest.fixture
def scene(swarm: LabSwarm, watch: Watch) -> Iterator[Scene]:
    with driving(swarm, watch) as scene:
        yield scene


Fault = Callable[[Scene], AbstractContextManager[float]]  # entered with the moment, undone on leaving


def signal_to_publisher(number: int) -> Fault:
    @contextmanager
    def happens(scene: Scene) -> Iterator[float]:
        yield scene.commander.send(number)

    return happens


def signal_to_drivers(number: int) -> Fault:
    @contextmanager
    def happens(scene: Scene) -> Iterator[float]:
        pids, moment = scene.drivers(), time.monotonic()
        assert len(pids) == len(SPEEDS)
        for pid in pids:
            os.kill(pid, number)
        yield moment
        scene.obeyed_again()

    return happens


@contextmanager
def a_stranger_goes_on(scene: Scene) -> Iterator[float]:
    with commanding(scene.swarm, PI, SPEEDS, "stranger") as stranger:
        stranger.command(1.0)
        time.sleep(0.5)
        yield scene.commander.send(signal.SIGKILL)
        time.sleep(1.0)
        assert not any(map(moves, scene.swarm.robots().values())), "the stranger is obeyed"


@contextmanager
def no_numbers(scene: Scene) -> Iterator[float]:
    yield scene.commander.command(float("nan"))


@contextmanager
def publisher_cut_off(scene: Scene) -> Iterator[float]:
    moment = time.monotonic()
    scene.swarm.cut(LAPTOP)
    yield moment
    scene.swarm.join(LAPTOP)
    scene.swarm.hang_up(LAPTOP)


@contextmanager
def leader_without_power(scene: Scene) -> Iterator[float]:
    moment = time.monotonic()
    scene.swarm.kill(LAPTOP)
    yield moment
    scene.swarm.start(LAPTOP)


@contextmanager
def master_killed(scene: Scene) -> Iterator[float]:
    yield signalled(scene.swarm, LAPTOP, signal.SIGKILL, "/usr/bin/rosmaster")


@contextmanager
def driver_raises(scene: Scene) -> Iterator[float]:
    """The drivers import at their start what raises an exception in the loop that drives."""
    module = RAISE_IN_LOOP.read_text().encode()
    there = "cd $(python3 -c 'import site; print(site.getsitepackages()[0])')"
    write = (
        f"{there} && echo {b64encode(module).decode()} | base64 -d | sudo tee raise_in_loop.py >/dev/null"
        " && echo import raise_in_loop | sudo tee raise_in_loop.pth >/dev/null"
    )
    scene.swarm.shell(PI, f"{write} && sudo systemctl restart {units()}")
    scene.obeyed_again()
    time.sleep(0.3)
    with signal_to_drivers(signal.SIGUSR1)(scene) as moment:
        yield moment
    scene.swarm.shell(PI, f"{there} && sudo rm raise_in_loop.py raise_in_loop.pth")


@contextmanager
def units_stopped(scene: Scene) -> Iterator[float]:
    yield from_within(scene.swarm, PI, f"sudo systemctl stop {units()}")
    scene.swarm.shell(PI, f"sudo systemctl start {units()}")


@contextmanager
def cables_back(scene: Scene) -> Iterator[float]:
    for robot in SPEEDS:
        lab.unplug(scene.swarm.name, robot)
    scene.commander.send(signal.SIGKILL)
    time.sleep(OUT)
    scene.left_alone()
    moment = time.monotonic()
    for robot in SPEEDS:
        lab.plug(scene.swarm.name, robot)
    yield moment


@contextmanager
def driver_s_host_back(scene: Scene) -> Iterator[float]:
    scene.swarm.kill(PI)
    scene.commander.send(signal.SIGKILL)
    time.sleep(OUT)
    scene.left_alone()
    moment = time.monotonic()
    scene.swarm.start(PI)
    yield moment


@contextmanager
def driver_s_host_reboots(scene: Scene) -> Iterator[float]:
    boots = scene.swarm.boots(PI)
    yield from_within(scene.swarm, PI, "sudo systemctl --no-block reboot")
    until(lambda: scene.swarm.boots(PI) == boots + 1, "the host does not reboot")
    scene.swarm.start(PI)


FAULTS: Mapping[str, Fault] = {
    "publisher killed": signal_to_publisher(signal.SIGKILL),
    "publisher hung": signal_to_publisher(signal.SIGSTOP),
    "publisher killed, a stranger goes on": a_stranger_goes_on,
    "publisher sends NaN": no_numbers,
    "publisher's host cut off the network": publisher_cut_off,
    "publisher's and master's host without power": leader_without_power,
    "master killed": master_killed,
    "driver killed (SIGKILL)": signal_to_drivers(signal.SIGKILL),
    "driver hung (SIGSTOP)": signal_to_drivers(signal.SIGSTOP),
    "exception in the driver's loop": driver_raises,
    "driver's unit stopped": units_stopped,
    "driver's host rebooted": driver_s_host_reboots,
    "driver's host switched on again": driver_s_host_back,
    "robot's cable plugged in again": cables_back,
}
GHOSTS = "network back, its publisher dead by then"


@pytest.fixture
def keeps(
    promise: Promise, regenerating: bool, watch: Watch, ros: str
) -> Callable[[str, float, Mapping[str, Stop]], None]:
    """Writes figures down, and compares them with what the page promises."""

    def keep(fault: str, since: float, stops: Mapping[str, Stop]) -> None:
        page = Page(ros)
        if regenerating:
            assert watch.rate(since) >= WRITTEN, "this machine is too busy for the page"
            page.write(fault, stops)
        bound = page.bound(fault)
        for robot, stop in stops.items():
            promise(f"{ros}, {fault}: {robot}, until it stands", stop.seconds - stop.withheld, bound)

    return keep


def late(stops: Mapping[str, Stop], bound: float) -> Mapping[str, Stop]:
    """Who drove for longer or farther than ``bound`` s allow."""
    return {
        robot: stop
        for robot, stop in stops.items()
        if stop.seconds > bound or stop.metres > bound * SPEEDS[robot]
    }


def faults_of(ros: str) -> tuple[str, ...]:
    """In ROS 2 no node ends because a discovery server does."""
    return tuple(one for one in FAULTS if (ros, one) != (ROS_2, "master killed"))


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "fault" in metafunc.fixturenames and metafunc.cls is not None:
        metafunc.parametrize("fault", faults_of(metafunc.cls.ROS))


class DeadMan:
    """The faults of one ROS."""

    ROS: str

    def test_whatever_fails_robots_stand_in_time(
        self,
        fault: str,
        swarm: LabSwarm,
        watch: Watch,
        keeps: Callable[[str, float, Mapping[str, Stop]], None],
    ) -> None:
        with driving(swarm, watch) as scene, FAULTS[fault](scene) as moment:
            stops = watch.stops(moment)
        keeps(fault, moment, stops)

    def test_commands_delayed_by_a_network_move_a_robot_as_one_command(
        self, scene: Scene, keeps: Callable[[str, float, Mapping[str, Stop]], None]
    ) -> None:
        scene.swarm.cut(LAPTOP)
        time.sleep(OUT)
        scene.commander.send(signal.SIGKILL)
        moment = time.monotonic()
        scene.swarm.join(LAPTOP)
        scene.swarm.hang_up(LAPTOP)
        time.sleep(KEPT)
        assert not any(map(moves, scene.swarm.robots().values()))
        keeps(GHOSTS, moment, scene.watch.moved(moment, moment + KEPT))


class TestRos1(DeadMan):
    """By rospy."""

    ROS = ROS_1


class TestRos2(DeadMan):
    """By rclpy."""

    ROS = ROS_2
