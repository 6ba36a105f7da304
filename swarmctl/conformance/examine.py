"""All checks in their order. Whatever happens in one of them, the robot stands when it is over."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator

from swarm_driver.link import FAILED_EXCHANGE, LinkLostError
from swarm_driver.port import PortError

from swarmctl.conformance import moving, talking
from swarmctl.conformance.bench import Bench
from swarmctl.conformance.results import Result, Verdict

Check = Callable[[Bench], Iterator[Result]]

FIRST: tuple[Check, ...] = (talking.confirms_a_stop, talking.says_its_firmware)  # without these nothing goes
OTHERS: tuple[tuple[str, Check], ...] = (
    ("setup", talking.takes_its_setup),
    ("questions", talking.answers_questions),
    ("actuators", talking.takes_settings),
    ("motion", moving.drives_as_ordered),
    ("stands after a stop", moving.stands_after_a_stop),
    ("dead-man of the driver", moving.stops_for_its_dead_man),
    ("driver killed in motion", moving.stops_by_itself),
    ("half a request", talking.recovers_from_half_a_request),
    ("reconnect", talking.recovers_from_a_reconnect),
    ("replies", talking.answers_in_time),
)


def examine(bench: Bench) -> Generator[Result, None, None]:
    """Every result as it comes. ``PortError`` without a port at first; ``NotStoppedError`` at the end."""
    bench.connect()
    try:
        for check in FIRST:
            found = list(check(bench))
            yield from found
            if any(one.verdict is Verdict.FAIL for one in found):
                return
        for name, check in OTHERS:
            try:
                yield from check(bench)
                bench.stop()
            except (*FAILED_EXCHANGE, LinkLostError) as error:  # noqa: PERF203
                yield Result(name, Verdict.FAIL, str(error), bench.config.serial.hint)
    except PortError as error:
        yield Result("line", Verdict.FAIL, str(error), "is the cable loose? then try again")
    finally:
        bench.leave()
