"""Checks of a board's protocol: topics, firmware, rates, lost frames."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from statistics import median

from swarm_onboard.driver.link import LinkLostError
from swarm_onboard.driver.rosserial_robot import COMMAND
from swarm_onboard.driver.sketch_drift import Drift
from swarm_onboard.rosserial import frames
from swarm_onboard.rosserial.messages import TWIST_TYPE
from swarm_onboard.rosserial.topics import Topic

from swarmctl.conformance.board_bench import BoardBench, type_of
from swarmctl.conformance.board_motion_checks import first_count
from swarmctl.conformance.results import Result, fail, ok, warn

_WATCH = 3.0  # s in which rates are measured
_TIME = 6.0  # s in which a board requests the time twice
_GREETING = 2.0  # s in which a swarmctl sketch reports its digest
_SLOW, _FAST = 0.8, 1.25  # of the declared rate; a driver warns beyond
_OFF = 0.5  # of the declared rate; not explained by load
_LONG = 0.5  # s for an answer; a driver repeats its request after four times as much
_ANSWER = 2.0  # s
_MANY = 0.02  # of all frames


def announces_topics(bench: BoardBench) -> Iterator[Result]:
    """Comes first: nothing is sent to a board that does not announce its topics."""
    hint = bench.config.serial.hint or "check the cable, the sketch, and its baud rate"
    try:
        took = bench.negotiate()
    except LinkLostError as error:
        check = "protocol" if bench.conversation.reader.old_protocol else "board"
        yield fail(check, str(error), hint)
        return
    settle = bench.config.serial.settle
    yield ok("board", f"announces its topics {took:.2f} s after the line is opened ({settle:g} s settle)")
    yield ok("protocol", "rosserial 2, of ROS hydro to noetic")
    assert bench.announced is not None
    subscribed = [one.type for one in bench.announced.topics if one.name == COMMAND and not one.published]
    if subscribed == [TWIST_TYPE]:
        yield ok("subscribes to commands", f"{COMMAND}, {TWIST_TYPE}")
        return
    drift = Drift(bench.protocol)
    drift.negotiated(bench.announced)
    why_not = drift.why_not(COMMAND, subscribed)
    yield fail("subscribes to commands", why_not, "fix the sketch: it cannot be driven")


def has_declared_topics(bench: BoardBench) -> Iterator[Result]:
    """Checks names, types and buffer sizes. A type without a definition on this machine is only a warning."""
    announced = bench.announced
    assert announced is not None
    declared = {**bench.protocol.publishes, **bench.protocol.subscribes}
    for refusal in announced.refusals:
        check = f"topic {refusal.name}"
        if refusal.name in declared and type_of(declared[refusal.name]) is None:
            fix = "its definition cannot be compared without ROS"
            yield warn(check, refusal.reason, fix)
        else:
            yield fail(check, refusal.reason, "fix the sketch, or flash it again")
    drift = Drift(replace(bench.protocol, firmware=""))
    drift.negotiated(replace(announced, refusals=()))
    refused = {one.name for one in announced.refusals}
    wrong = [one for one in drift.complaints("") if not any(f"`{name}`" in one for name in refused)]
    if wrong:
        fix = "fix `publishes` and `subscribes` of the type, or flash its sketch"
        yield fail("topics", "; ".join(wrong), fix)
    else:
        yield ok("topics", ", ".join(map(_sized, announced.topics)))


def _sized(topic: Topic) -> str:
    known = type_of(topic.type)
    least = f"{known.least} of " if known else ""
    return f"{topic.name} {topic.type.partition('/')[2]} ({least}{topic.capacity} bytes)"


def reports_firmware(bench: BoardBench) -> Iterator[Result]:
    """Compares the digest that a swarmctl sketch reports with that of the spec."""
    bench.run(_GREETING, until=lambda: bool(bench.firmware))
    wanted, reported = bench.protocol.firmware, bench.firmware
    if not reported:
        doubt = fail if wanted else warn
        yield doubt("firmware", "the sketch reports no digest", "flash it with `swarmctl firmware flash`")
    elif not wanted:
        yield ok("firmware", f"{reported}; use --spec to compare it")
    elif reported == wanted:
        yield ok("firmware", f"{reported}, as in the spec")
    else:
        wrong = Drift(bench.protocol).complaints(reported)
        yield fail("firmware", "; ".join(wrong))


def publishes_at_declared_rates(bench: BoardBench) -> Iterator[Result]:
    """Each topic arrives at the rate that the type declares."""
    bench.arrivals.clear()
    bench.run(_WATCH)
    for name, declared in bench.protocol.rates.items():
        yield _rated(bench, name, declared)
    bench.run(_TIME, until=lambda: len(_time_requests(bench)) > 1)
    yield _times(_time_requests(bench))


def _rated(bench: BoardBench, name: str, declared: float) -> Result:
    check, stamps = f"rate {name}", bench.arrivals[name]
    if name in bench.bad_messages:
        return fail(check, f"an invalid message: {bench.bad_messages[name]}", "fix the sketch")
    if len(stamps) < 2:
        figure = f"{len(stamps)} messages in {_WATCH:g} s"
        return fail(check, figure, "check that the sketch publishes it")
    rate = (len(stamps) - 1) / (stamps[-1] - stamps[0])
    figure = f"{rate:.1f} of {declared:g} Hz"
    if _SLOW * declared <= rate <= _FAST * declared:
        return ok(check, figure)
    doubt = fail if rate < _OFF * declared else warn
    return doubt(check, figure, f"fix the `rate` of `{name}`, or the sketch")


def _time_requests(bench: BoardBench) -> list[float]:
    return [at for at, topic in bench.frames if topic == frames.ID_TIME]


def _times(requests: list[float]) -> Result:
    if len(requests) < 2:
        figure = f"requested {'once' if requests else 'never'} in {_TIME:g} s"
        return fail("time", figure, "fix the sketch: a driver drops the board after 15 s")
    every = [after - before for before, after in pairwise(requests)]
    return ok("time", f"requested every {max(every):.1f} s")


def answers_in_time(bench: BoardBench) -> Iterator[Result]:
    """Measures topic request to answer, and command to first count."""
    took = [one for _ in range(bench.pace.questions) if (one := _answer(bench)) is not None]
    if not took:
        yield fail("latency", "no topic request is answered", bench.config.serial.hint)
        return
    missing = bench.pace.questions - len(took)
    slow = max(took) > _LONG or missing
    count = first_count(bench) if bench.has_counters else None
    figure = (
        f"topics answered in {median(took) * 1000:.0f} ms, at most {max(took) * 1000:.0f} ms, {missing} of "
        f"{bench.pace.questions} not"
        + (f"; {count * 1000:.0f} ms from a command to the first count" if count else "")
    )
    yield warn("latency", figure, "check the line") if slow else ok("latency", figure)


def _answer(bench: BoardBench) -> float | None:
    """Requests the topics; returns the seconds until the first announcement, None without one."""
    known, began = len(bench.frames), bench.clock()
    bench.port.write(frames.REQUEST_TOPICS)

    def announced() -> bool:
        return any(topic in (frames.ID_PUBLISHER, frames.ID_SUBSCRIBER) for _, topic in bench.frames[known:])

    if not bench.run(_ANSWER, until=announced):
        return None
    took = bench.clock() - began
    bench.run(2 * _LONG / 5)  # the rest of the announcements
    return took


def loses_no_frames(bench: BoardBench) -> Iterator[Result]:
    """Reports frames damaged and bytes lost so far."""
    bench.run(_WATCH)
    losses = [one.reader.losses for one in bench.conversations]
    damaged, lost = sum(one.frames for one in losses), sum(one.bytes for one in losses)
    share = damaged / max(1, len(bench.frames) + damaged)
    figure = f"{damaged} of {len(bench.frames) + damaged} frames damaged, {lost} bytes lost"
    if not damaged:
        yield ok("line", figure)
    else:
        doubt = fail if share > _MANY else warn
        yield doubt("line", figure, "check the cable, the ground, the baud rate")
