"""All checks in their order. Whatever happens in one of them, the robot stands when it is over."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

from swarm_driver.link import FAILED_EXCHANGE, LinkLostError
from swarm_driver.port import PortError

from swarmctl.conformance import board_moving, board_talking, moving, talking, whole_driver
from swarmctl.conformance.bench import Bench
from swarmctl.conformance.board_bench import BoardBench
from swarmctl.conformance.results import Result, Verdict
from swarmctl.conformance.wheeled import Wheeled

B = TypeVar("B", bound=Wheeled)


@dataclass(frozen=True)
class Checks(Generic[B]):
    """``first``: without these nothing goes on."""

    first: tuple[Callable[[B], Iterator[Result]], ...]
    others: tuple[tuple[str, Callable[[B], Iterator[Result]]], ...]


ASKED = Checks[Bench](
    first=(talking.confirms_a_stop, talking.says_its_firmware),
    others=(
        ("setup", talking.takes_its_setup),
        ("questions", talking.answers_questions),
        ("actuators", talking.takes_settings),
        ("motion", moving.drives_as_ordered),
        ("stands after a stop", moving.stands_after_a_stop),
        ("dead-man of the driver", whole_driver.stops_for_its_dead_man),
        ("driver killed in motion", moving.stops_by_itself),
        ("half a request", talking.recovers_from_half_a_request),
        ("reconnect", talking.recovers_from_a_reconnect),
        ("replies", talking.answers_in_time),
    ),
)
BOARD = Checks[BoardBench](
    first=(board_talking.negotiates,),
    others=(
        ("topics", board_talking.has_the_topics_of_its_type),
        ("firmware", board_talking.says_its_firmware),
        ("rates", board_talking.publishes_at_its_rates),
        ("motion", moving.drives_as_ordered),
        ("limits of the firmware", board_moving.keeps_its_limits),
        ("stands after a stop", board_moving.stands_after_a_stop),
        ("dead-man of the firmware", board_moving.stops_by_itself),
        ("dead-man of the driver", whole_driver.stops_for_its_dead_man),
        ("garbage", board_moving.hears_after_garbage),
        ("half a frame", board_moving.hears_after_half_a_frame),
        ("goodbye", board_moving.comes_back_after_a_goodbye),
        ("latency", board_talking.answers_in_time),
        ("line", board_talking.loses_nothing),
        ("reconnect", board_moving.comes_back_after_a_reconnect),
    ),
)


def examine(bench: B, checks: Checks[B]) -> Generator[Result, None, None]:
    """Every result as it comes. ``PortError`` without a port at first; ``NotStoppedError`` at the end."""
    bench.connect()
    try:
        for check in checks.first:
            found = list(check(bench))
            yield from found
            if any(one.verdict is Verdict.FAIL for one in found):
                return
        for name, check in checks.others:
            yield from _told(name, check(bench), bench)
            yield from _told(f"stop after {name}", _stopped(bench), bench)
    except PortError as error:
        yield Result("line", Verdict.FAIL, str(error), "is the cable loose? then try again")
    finally:
        bench.leave()


def _told(name: str, results: Iterator[Result], bench: Wheeled) -> Iterator[Result]:
    """What a check finds, or what it fails of."""
    try:
        yield from results
    except (*FAILED_EXCHANGE, LinkLostError) as error:
        yield Result(name, Verdict.FAIL, str(error), bench.config.serial.hint)


def _stopped(bench: Wheeled) -> Iterator[Result]:
    """Nothing to tell, if it stands."""
    bench.stop()
    yield from ()
