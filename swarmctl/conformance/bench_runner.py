"""Runs all checks in order. Whatever happens in one of them, the robot stands at the end."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

from swarm_onboard.driver.link import FAILED_EXCHANGE, LinkLostError
from swarm_onboard.driver.port import PortError

from swarmctl.conformance import (
    board_motion_checks,
    board_protocol_checks,
    driver_checks,
    motion_checks,
    protocol_checks,
)
from swarmctl.conformance.bench import Bench
from swarmctl.conformance.board_bench import BoardBench
from swarmctl.conformance.polled_bench import PolledBench
from swarmctl.conformance.results import Result, Verdict, fail

B = TypeVar("B", bound=Bench)


@dataclass(frozen=True)
class Checks(Generic[B]):
    """The checks of a kind of robot. If one of ``first`` fails, the others do not run."""

    first: tuple[Callable[[B], Iterator[Result]], ...]
    others: tuple[tuple[str, Callable[[B], Iterator[Result]]], ...]


POLLED_CHECKS = Checks[PolledBench](
    first=(protocol_checks.confirms_stop, protocol_checks.reports_firmware),
    others=(
        ("setup", protocol_checks.accepts_setup),
        ("queries", protocol_checks.answers_queries),
        ("actuators", protocol_checks.sets_actuators),
        ("motion", motion_checks.drives_as_commanded),
        ("stands after a stop", motion_checks.stands_after_stop),
        ("dead-man of the driver", driver_checks.driver_dead_man_stops),
        ("driver killed in motion", motion_checks.stops_by_itself),
        ("half a request", protocol_checks.recovers_from_half_a_request),
        ("reconnect", protocol_checks.recovers_from_a_reconnect),
        ("replies", protocol_checks.answers_in_time),
    ),
)
BOARD_CHECKS = Checks[BoardBench](
    first=(board_protocol_checks.announces_topics,),
    others=(
        ("topics", board_protocol_checks.has_declared_topics),
        ("firmware", board_protocol_checks.reports_firmware),
        ("rates", board_protocol_checks.publishes_at_declared_rates),
        ("motion", motion_checks.drives_as_commanded),
        ("limits of the firmware", board_motion_checks.keeps_limits),
        ("stands after a stop", board_motion_checks.stands_after_stop),
        ("dead-man of the firmware", board_motion_checks.stops_by_itself),
        ("dead-man of the driver", driver_checks.driver_dead_man_stops),
        ("garbage", board_motion_checks.recovers_from_garbage),
        ("half a frame", board_motion_checks.recovers_from_half_a_frame),
        ("TX_STOP", board_motion_checks.recovers_from_tx_stop),
        ("latency", board_protocol_checks.answers_in_time),
        ("line", board_protocol_checks.loses_no_frames),
        ("reconnect", board_motion_checks.board_recovers_from_a_reconnect),
    ),
)


def run_checks(bench: B, checks: Checks[B]) -> Generator[Result, None, None]:
    """Yields every result.

    Raises ``PortError`` if the port cannot be opened, ``NotStoppedError`` at the end.
    """
    bench.connect()
    try:
        for check in checks.first:
            found = list(check(bench))
            yield from found
            if any(one.verdict is Verdict.FAIL for one in found):
                return
        for name, check in checks.others:
            yield from _guarded(name, check(bench), bench)
            yield from _guarded(f"stop after {name}", _stopped(bench), bench)
    except PortError as error:
        yield fail("line", str(error), "check the cable, then run the test again")
    finally:
        bench.finish()


def _guarded(name: str, results: Iterator[Result], bench: Bench) -> Iterator[Result]:
    """Yields the results of a check, or a failure if its exchange fails."""
    try:
        yield from results
    except (*FAILED_EXCHANGE, LinkLostError) as error:
        yield fail(name, str(error), bench.config.serial.hint)


def _stopped(bench: Bench) -> Iterator[Result]:
    """Stops the robot; yields nothing if it stands."""
    bench.stop()
    yield from ()
