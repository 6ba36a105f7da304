"""Checks of what moves and stops a board's wheels: its limits, its dead-man, what spoils the line."""

from __future__ import annotations

from collections.abc import Iterator

from swarm_driver.link import LinkLostError
from swarm_rosserial import frames

from swarmctl.conformance.board_bench import KEEP_UP, STANDSTILL, BoardBench
from swarmctl.conformance.moving import slowly
from swarmctl.conformance.results import Result, Verdict

_MUCH = 3.0  # times the top speed
_TOO_FAST = 1.25  # times the top speed
_BRAKING = 0.35  # s
_PERIODS = 2  # of the counters, which a moment is uncertain by
_HEARS = 2.0  # s in which an order turns a wheel
_LATE = 1.0  # s
_QUIET = 1.0  # s
# None of it begins a frame, which some clients write beyond their buffer.
_GARBAGE = bytes(range(0x20, 0x7F))


def keeps_its_limits(bench: BoardBench) -> Iterator[Result]:
    """No driver says this. The firmware has to know what its wheels can do."""
    if not bench.counts:
        return
    check, most = "limits of the firmware", bench.config.kinematics.wheel_speed_max
    try:
        motion = bench.measured((_MUCH * most, 0.0))
    finally:
        bench.stop()
    fastest = max(map(abs, motion.measured))
    figure = f"{_MUCH * most:g} m/s makes {fastest:.3f} m/s; the limit is {most:g}"
    if fastest > _TOO_FAST * most + 2 * motion.resolution:
        yield Result(check, Verdict.FAIL, figure, "mend the sketch, or `wheel_speed_max`")
    else:
        yield Result(check, Verdict.OK, figure)


def stands_after_a_stop(bench: BoardBench) -> Iterator[Result]:
    """Sooner than its dead-man would make it stand."""
    if not bench.counts:
        return
    with bench.driving(slowly(bench), 0.0) as order:
        bench.go_on(order, bench.pace.settle)
        began = bench.clock()
        bench.run(bench.pace.silence, STANDSTILL)
    took, check = max(0.0, bench.turned_at - began), "stands after a stop"
    figure, mend = f"the last count comes {took:.2f} s after it", "mend the sketch: 0 m/s is a stop"
    timeout = bench.protocol.firmware_timeout
    if took > timeout + _BRAKING:
        yield Result(check, Verdict.FAIL, figure, mend)
    elif took > timeout - 2 * KEEP_UP:
        yield Result(check, Verdict.WARN, f"{figure}, no sooner than its dead-man makes it", mend)
    else:
        yield Result(check, Verdict.OK, figure)


def stops_by_itself(bench: BoardBench) -> Iterator[Result]:
    """Silence while the line stays open: nothing else stops a robot whose host has died."""
    check, timeout = "dead-man of the firmware", bench.protocol.firmware_timeout
    if not bench.counts:
        yield Result(check, Verdict.WARN, "the type has no `odometry`: watch the wheels")
        return
    with bench.driving(slowly(bench), 0.0) as order:
        bench.go_on(order, bench.pace.settle)
        last = bench.said_at
        bench.run(max(bench.pace.silence, 2 * timeout))
        still = not bench.moving
        took = bench.turned_at - last
    unsure = _PERIODS / min(bench.protocol.rates.values())
    if not still:
        yield Result(
            check, Verdict.FAIL, f"the wheels turn {bench.clock() - last:.1f} s after the last order",
            "build a dead-man into the sketch: nothing else stops it",
        )  # fmt: skip
    elif took > timeout + _BRAKING + unsure:
        yield Result(
            check, Verdict.FAIL, _stood(took, timeout), "shorten the sketch's, or mend `firmware_timeout`"
        )
    elif took < timeout - unsure - bench.way / slowly(bench):
        yield Result(
            check, Verdict.WARN, _stood(took, timeout), "orders may stutter: mend `firmware_timeout`"
        )
    else:
        yield Result(check, Verdict.OK, _stood(took, timeout))


def _stood(took: float, timeout: float) -> str:
    return f"{took:.2f} s from the last order to the last count; {timeout:g} s is set"


def hears_after_garbage(bench: BoardBench) -> Iterator[Result]:
    bench.wire.write(_GARBAGE)
    yield from _hears(bench, "garbage")


def hears_after_half_a_frame(bench: BoardBench) -> Iterator[Result]:
    """A cable that was cut in the middle of an order, and put back in."""
    whole, _ = bench.speed_said(0.0)
    bench.wire.write(whole[: len(whole) // 2])
    yield from _hears(bench, "half a frame")


def _hears(bench: BoardBench, check: str) -> Iterator[Result]:
    if not bench.counts:
        return
    took = first_count(bench)
    if took is None:
        yield Result(
            check,
            Verdict.FAIL,
            f"no order turns a wheel for {_HEARS:g} s after it",
            "mend how the sketch reads frames",
        )
    else:
        late = took > _LATE
        mend = "the sketch loses more than one order over it" if late else ""
        yield Result(
            check, Verdict.WARN if late else Verdict.OK, f"a wheel turns {took:.2f} s after it", mend
        )


def first_count(bench: BoardBench) -> float | None:
    """Seconds from an order to the first count that comes of it; nothing if none comes."""
    began = bench.clock()
    with bench.driving(slowly(bench), 0.0) as order:
        turned = bench.run(_HEARS, order, until=lambda: bench.turned_at > began)
        return bench.clock() - began if turned else None


def comes_back_after_a_goodbye(bench: BoardBench) -> Iterator[Result]:
    """A host that says goodbye in motion: the wheels stand, nothing is published; then it is asked again."""
    check = "goodbye"
    with bench.driving(slowly(bench), 0.0) as order:
        bench.go_on(order, bench.pace.settle)
        bench.conversation.stop()
        bench.run(_BRAKING)
        bench.arrivals.clear()
        bench.run(_QUIET)
        talks = [name for name, stamps in bench.arrivals.items() if stamps]
        began, known = bench.clock(), len(bench.frames)
        bench.wire.write(frames.REQUEST_TOPICS)
        back = bench.run(_HEARS, until=lambda: len(bench.frames) > known)
        took = bench.clock() - began
        if bench.counts and back:
            bench.next_pose()
            bench.run(2 * _BRAKING)
        turns = bench.moving
    if turns:
        yield Result(check, Verdict.FAIL, "the wheels turn on", "mend the sketch: stop when the host is gone")
    elif not back:
        yield Result(
            check, Verdict.FAIL, f"no answer within {_HEARS:g} s when asked again", bench.config.serial.hint
        )
    elif talks:
        yield Result(
            check,
            Verdict.WARN,
            f"it goes on to publish {', '.join(talks)}",
            "mend the sketch: TX_STOP is unheard",
        )
    else:
        yield Result(check, Verdict.OK, f"it stands and is silent; asked again it answers in {took:.2f} s")


def comes_back_after_a_reconnect(bench: BoardBench) -> Iterator[Result]:
    """A driver killed in motion, and the next one: opening the line resets an UNO."""
    check, hint = "reconnect", bench.config.serial.hint
    bench.go_on((slowly(bench), 0.0), bench.pace.settle)
    bench.disconnect()
    try:
        took = bench.meet()
    except LinkLostError as error:
        yield Result(check, Verdict.FAIL, str(error), f"is `settle` long enough? {hint}")
        return
    if bench.counts:
        bench.next_pose()
        bench.run(2 * _BRAKING)
    if bench.moving:
        yield Result(
            check, Verdict.FAIL, "the wheels turn on without a driver", "build a dead-man into the sketch"
        )
    else:
        yield Result(check, Verdict.OK, f"it stands, and announces its topics after {took:.2f} s")
