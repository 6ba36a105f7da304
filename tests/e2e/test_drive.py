"""Driving: robots follow the commands of the leader, and stop as soon as none comes."""

from __future__ import annotations

import time
from contextlib import ExitStack
from dataclasses import dataclass

import pytest

from tests.e2e.at_once import at_once
from tests.e2e.lab_swarm import (
    LEADER,
    LabSwarm,
    Note,
    moves,
    until,
)
from tests.e2e.pose import Pose, wrapped
from tests.timing import Promise, withheld

STRETCH = 10.0  # s of driving that speeds and loads are measured over


@dataclass(frozen=True)
class Trip:
    """Which robot the leader commands, how fast (m/s, rad/s), and who listens to its odometry."""

    robot: str
    host: str
    received_on: str
    linear: float
    angular: float


TRIPS = (
    Trip("koala", "koala-laptop", "epuck-pi", 0.20, -0.3),
    Trip("k3", "k3-pi", "koala-laptop", 0.10, 0.5),
    Trip("epuck", "epuck-pi", "k3-pi", 0.05, 0.4),
)
ROBOTS = tuple(trip.robot for trip in TRIPS)


@dataclass(frozen=True)
class Load:
    """What a driver's process took: memory (MB) and its share of one core (%)."""

    megabytes: float
    percent: float


@dataclass(frozen=True)
class Driven:
    """What one robot did: its speeds on the way, the way by truth and by odometry, the stop."""

    linear: float
    angular: float
    way: Pose
    odometry: Pose
    length: float
    standstill: float
    withheld: float  # s in which the machine let some process wait for a CPU meanwhile
    load: Load


@pytest.fixture(scope="module")
def driven(shared_lab: LabSwarm, first_time: object) -> dict[str, Driven]:
    """All three robots driven at once for a while, until their publishers are killed."""
    swarm = shared_lab
    truth = {trip.robot: swarm.truth(trip.robot) for trip in TRIPS}
    odometry = {trip.robot: swarm.odometry(trip.received_on, trip.robot) for trip in TRIPS}
    with ExitStack() as stack:
        publishers = [
            stack.enter_context(swarm.publishing(LEADER, trip.robot, trip.linear, trip.angular))
            for trip in TRIPS
        ]
        until(lambda: all(map(moves, swarm.robots().values())), "not every robot moves")
        time.sleep(0.5)
        clock, before, spent = time.monotonic(), swarm.robots(), {t.robot: cpu(swarm, t) for t in TRIPS}
        time.sleep(STRETCH)
        after, passed = swarm.robots(), time.monotonic() - clock
        loads = {
            trip.robot: Load(memory(swarm, trip), 100 * (cpu(swarm, trip) - spent[trip.robot]) / passed)
            for trip in TRIPS
        }
        standstill, lost = {}, withheld()

        def kill(index: int) -> None:
            publisher, robot = publishers[index], TRIPS[index].robot
            swarm.shell(publisher.host, f"kill -9 {publisher.pid}")
            standstill.update(swarm.seconds_to_standstill(robot))

        at_once([lambda index=index: kill(index) for index in range(len(TRIPS))])
        lost = withheld() - lost
    time.sleep(0.3)
    return {
        trip.robot: Driven(
            linear=(after[trip.robot]["distance"] - before[trip.robot]["distance"]) / passed,
            angular=(after[trip.robot]["theta"] - before[trip.robot]["theta"]) / passed,
            way=swarm.truth(trip.robot).seen_from(truth[trip.robot]),
            odometry=swarm.odometry(trip.received_on, trip.robot).seen_from(odometry[trip.robot]),
            length=swarm.robot(trip.robot)["distance"],
            standstill=standstill[trip.robot],
            withheld=lost,
            load=loads[trip.robot],
        )
        for trip in TRIPS
    }


def cpu(swarm: LabSwarm, trip: Trip) -> float:
    """Seconds of processor time that the driver's process has had."""
    pid = swarm.units(trip.host)[trip.robot].pid
    ticks, per_second = swarm.shell(trip.host, f"cat /proc/{pid}/stat; getconf CLK_TCK").splitlines()
    fields = ticks.rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / int(per_second)


def memory(swarm: LabSwarm, trip: Trip) -> float:
    """Resident memory of the driver's process, in MB."""
    pid = swarm.units(trip.host)[trip.robot].pid
    return int(swarm.shell(trip.host, f"grep VmHWM /proc/{pid}/status").split()[1]) / 1024


@pytest.mark.parametrize("trip", TRIPS, ids=ROBOTS)
class TestATripOrderedByTheLeader:
    def test_goes_at_the_commanded_speed(self, trip: Trip, driven: dict[str, Driven], note: Note) -> None:
        got = driven[trip.robot]
        note(
            f"speed of {trip.robot}, commanded {trip.linear} m/s {trip.angular:+} rad/s",
            f"{got.linear:.4f} m/s {got.angular:+.4f} rad/s",
            "within 5 %",
        )
        assert got.linear == pytest.approx(trip.linear, rel=0.05)
        assert got.angular == pytest.approx(trip.angular, rel=0.05)

    def test_odometry_reports_the_trip(self, trip: Trip, driven: dict[str, Driven], note: Note) -> None:
        got = driven[trip.robot]
        astray = ((got.odometry.x - got.way.x) ** 2 + (got.odometry.y - got.way.y) ** 2) ** 0.5
        note(
            f"odometry of {trip.robot} after {got.length:.2f} m",
            f"{1000 * astray:.1f} mm, {abs(wrapped(got.odometry.theta - got.way.theta)):.4f} rad astray",
            "<= 2 % of the way, 0.05 rad",
        )
        assert astray <= 0.02 * got.length
        assert wrapped(got.odometry.theta - got.way.theta) == pytest.approx(0, abs=0.05)

    def test_ends_when_its_publisher_is_killed(
        self, trip: Trip, driven: dict[str, Driven], promise: Promise
    ) -> None:
        got = driven[trip.robot]
        promise(
            f"standstill of {trip.robot} after SIGKILL of the publisher", got.standstill - got.withheld, 0.7
        )

    def test_takes_little_of_its_host(self, trip: Trip, driven: dict[str, Driven], note: Note) -> None:
        load = driven[trip.robot].load
        note(
            f"driver of {trip.robot} at 10 commands/s",
            f"{load.megabytes:.1f} MB, {load.percent:.1f} % of a core",
            "<= 60 MB, <= 2 %",
        )
        assert load.megabytes <= 60
