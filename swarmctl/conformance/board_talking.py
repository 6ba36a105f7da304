"""Checks of what a board says by itself: its topics, its firmware, its rates, and what of it is lost."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from statistics import median

from swarm_driver.board import COMMAND
from swarm_driver.drift import Drift
from swarm_driver.link import LinkLostError
from swarm_rosserial import frames
from swarm_rosserial.messages import TWIST_TYPE
from swarm_rosserial.topics import Topic

from swarmctl.conformance.board_bench import BoardBench, type_of
from swarmctl.conformance.board_moving import first_count
from swarmctl.conformance.results import Result, Verdict

_WATCH = 3.0  # s in which rates are measured
_TIME = 6.0  # s in which a board asks for the time twice
_GREETING = 2.0  # s in which a sketch of ours names itself
_SLOW, _FAST = 0.8, 1.25  # of the declared rate, as a driver complains of it
_OFF = 0.5  # of the declared rate, which no load explains
_LONG = 0.5  # s for an answer, a quarter of the time after which a driver asks again
_ANSWER = 2.0  # s
_MANY = 0.02  # of all frames


def negotiates(bench: BoardBench) -> Iterator[Result]:
    """Before all else: a board that does not say what it hears is told nothing."""
    hint = bench.config.serial.hint or "check the cable, the sketch, and its baud rate"
    try:
        took = bench.meet()
    except LinkLostError as error:
        check = "protocol" if bench.conversation.reader.old_protocol else "board"
        yield Result(check, Verdict.FAIL, str(error), hint)
        return
    settle = bench.config.serial.settle
    yield Result(
        "board",
        Verdict.OK,
        f"announces its topics {took:.2f} s after the line is opened ({settle:g} s settle)",
    )
    yield Result("protocol", Verdict.OK, "rosserial 2, of ROS hydro to noetic")
    assert bench.announced is not None
    heard = [one.type for one in bench.announced.topics if one.name == COMMAND and not one.published]
    if heard == [TWIST_TYPE]:
        yield Result("hears orders", Verdict.OK, f"{COMMAND}, {TWIST_TYPE}")
        return
    drift = Drift(bench.protocol)
    drift.negotiated(bench.announced)
    yield Result(
        "hears orders", Verdict.FAIL, drift.why_not(COMMAND, heard), "mend the sketch: nothing drives it"
    )


def has_the_topics_of_its_type(bench: BoardBench) -> Iterator[Result]:
    """Names, types, and room in its buffers. What this machine knows no definition of is no fault of its."""
    announced = bench.announced
    assert announced is not None
    declared = {**bench.protocol.publishes, **bench.protocol.subscribes}
    for refusal in announced.refusals:
        check = f"topic {refusal.name}"
        if refusal.name in declared and type_of(declared[refusal.name]) is None:
            mend = "without ROS its definition is not compared here"
            yield Result(check, Verdict.WARN, refusal.reason, mend)
        else:
            yield Result(check, Verdict.FAIL, refusal.reason, "mend the sketch, or flash it anew")
    drift = Drift(replace(bench.protocol, firmware=""))
    drift.negotiated(replace(announced, refusals=()))
    refused = {one.name for one in announced.refusals}
    wrong = [one for one in drift.complaints("") if not any(f"`{name}`" in one for name in refused)]
    told = ", ".join(map(_sized, announced.topics))
    mend = "mend `publishes` and `subscribes` of the type, or flash its sketch" if wrong else ""
    yield Result("topics", Verdict.FAIL if wrong else Verdict.OK, "; ".join(wrong) or told, mend)


def _sized(topic: Topic) -> str:
    known = type_of(topic.type)
    least = f"{known.least} of " if known else ""
    return f"{topic.name} {topic.type.partition('/')[2]} ({least}{topic.room} bytes)"


def says_its_firmware(bench: BoardBench) -> Iterator[Result]:
    """A sketch of swarmctl's names the digest of its source; a spec makes one for each robot."""
    bench.run(_GREETING, until=lambda: bool(bench.firmware))
    wanted, told = bench.protocol.firmware, bench.firmware
    if not told:
        verdict = Verdict.FAIL if wanted else Verdict.WARN
        yield Result(
            "firmware", verdict, "the sketch names none", "is it swarmctl's? `swarmctl firmware flash`"
        )
    elif not wanted:
        yield Result("firmware", Verdict.OK, f"{told}; --spec compares it with a robot's")
    else:
        wrong = Drift(replace(bench.protocol, publishes={}, subscribes={})).complaints(told)
        yield Result(
            "firmware",
            Verdict.FAIL if wrong else Verdict.OK,
            "; ".join(wrong) or f"{told}, as the spec has it",
        )


def publishes_at_its_rates(bench: BoardBench) -> Iterator[Result]:
    bench.arrivals.clear()
    bench.run(_WATCH)
    for name, declared in bench.protocol.rates.items():
        yield _rated(bench, name, declared)
    bench.run(_TIME, until=lambda: len(_times_asked(bench)) > 1)
    yield _times(_times_asked(bench))


def _rated(bench: BoardBench, name: str, declared: float) -> Result:
    check, stamps = f"rate {name}", bench.arrivals[name]
    if name in bench.misfits:
        return Result(
            check, Verdict.FAIL, f"a message that is none: {bench.misfits[name]}", "mend the sketch"
        )
    if len(stamps) < 2:
        return Result(
            check, Verdict.FAIL, f"{len(stamps)} messages in {_WATCH:g} s", "does the sketch publish it?"
        )
    rate = (len(stamps) - 1) / (stamps[-1] - stamps[0])
    figure = f"{rate:.1f} of {declared:g} Hz"
    if _SLOW * declared <= rate <= _FAST * declared:
        return Result(check, Verdict.OK, figure)
    verdict = Verdict.FAIL if rate < _OFF * declared else Verdict.WARN
    return Result(check, verdict, figure, f"mend the `rate` of `{name}`, or the sketch")


def _times_asked(bench: BoardBench) -> list[float]:
    return [at for at, topic in bench.frames if topic == frames.ID_TIME]


def _times(asked: list[float]) -> Result:
    if len(asked) < 2:
        told = f"asked for {'once' if asked else 'never'} in {_TIME:g} s"
        return Result(
            "time", Verdict.FAIL, told, "without it a driver gives the board up after 15 s: mend the sketch"
        )
    every = [after - before for before, after in pairwise(asked)]
    return Result("time", Verdict.OK, f"asked for every {max(every):.1f} s")


def answers_in_time(bench: BoardBench) -> Iterator[Result]:
    """From a request for topics to the first word of the answer; from an order to the first count."""
    took = [one for _ in range(bench.pace.questions) if (one := _answer(bench)) is not None]
    if not took:
        yield Result("latency", Verdict.FAIL, "no request for topics is answered", bench.config.serial.hint)
        return
    missing = bench.pace.questions - len(took)
    slow = max(took) > _LONG or missing
    count = first_count(bench) if bench.counts else None
    figure = (
        f"topics answered in {median(took) * 1000:.0f} ms, at most {max(took) * 1000:.0f} ms, {missing} of "
        f"{bench.pace.questions} not"
        + (f"; {count * 1000:.0f} ms from an order to the first count" if count else "")
    )
    yield Result("latency", Verdict.WARN if slow else Verdict.OK, figure, "is the line good?" if slow else "")


def _answer(bench: BoardBench) -> float | None:
    """Seconds until the board announces a topic when it is asked."""
    known, began = len(bench.frames), bench.clock()
    bench.wire.write(frames.REQUEST_TOPICS)

    def announced() -> bool:
        return any(topic in (frames.ID_PUBLISHER, frames.ID_SUBSCRIBER) for _, topic in bench.frames[known:])

    if not bench.run(_ANSWER, until=announced):
        return None
    took = bench.clock() - began
    bench.run(2 * _LONG / 5)  # the rest of the announcements
    return took


def loses_nothing(bench: BoardBench) -> Iterator[Result]:
    """What was damaged on the line until now."""
    bench.run(_WATCH)
    losses = bench.conversation.reader.losses
    damaged, lost = bench.lost_frames + losses.frames, bench.lost_bytes + losses.bytes
    share = damaged / max(1, len(bench.frames) + damaged)
    figure = f"{damaged} of {len(bench.frames) + damaged} frames damaged, {lost} bytes lost"
    verdict = Verdict.FAIL if share > _MANY else Verdict.WARN if damaged else Verdict.OK
    yield Result("line", verdict, figure, "look at the cable, the ground, the baud rate" if damaged else "")
