"""Checks of a board's motion: limits, dead-man, recovery from line errors."""

from __future__ import annotations

from collections.abc import Iterator

from swarm_onboard.driver.link import LinkLostError
from swarm_onboard.rosserial import frames

from swarmctl.conformance.bench import STANDSTILL
from swarmctl.conformance.board_bench import BRAKING, COMMAND_REFRESH_S, BoardBench
from swarmctl.conformance.results import Result, fail, ok, warn

_MUCH = 3.0  # times the top speed
_TOO_FAST = 1.25  # times the top speed
_PERIODS = 2  # of the counters: the uncertainty of a time
_REACTS = 2.0  # s in which a command must turn a wheel
_LATE = 1.0  # s
_SILENCE = 1.0  # s
# No byte starts a frame: some clients would write it beyond their buffer.
_GARBAGE = bytes(range(0x20, 0x7F))


def keeps_limits(bench: BoardBench) -> Iterator[Result]:
    """Sends a command far above the limit, which no driver does: the firmware must limit it."""
    if not bench.has_counters:
        return
    check, most = "limits of the firmware", bench.config.kinematics.wheel_speed_max
    try:
        motion = bench.measured((_MUCH * most, 0.0))
    finally:
        bench.stop()
    fastest = max(map(abs, motion.measured))
    figure = f"{_MUCH * most:g} m/s results in {fastest:.3f} m/s; the limit is {most:g}"
    if fastest > _TOO_FAST * most + 2 * motion.resolution:
        yield fail(check, figure, "fix the sketch or `wheel_speed_max`")
    else:
        yield ok(check, figure)


def stands_after_stop(bench: BoardBench) -> Iterator[Result]:
    """Checks that a stop acts sooner than the dead-man."""
    if not bench.has_counters:
        return
    with bench.driving(bench.slow_speed) as velocity:
        bench.hold(velocity, bench.pace.settle)
        began = bench.clock()
        bench.run(bench.pace.silence, STANDSTILL)
    took, check = max(0.0, bench.turned_at - began), "stands after a stop"
    figure, fix = f"the last count comes {took:.2f} s after the stop", "fix the sketch: 0 m/s is a stop"
    timeout = bench.protocol.firmware_timeout
    if took > timeout + BRAKING:
        yield fail(check, figure, fix)
    elif took > timeout - 2 * COMMAND_REFRESH_S:
        yield warn(check, f"{figure}, no sooner than its dead-man would", fix)
    else:
        yield ok(check, figure)


def stops_by_itself(bench: BoardBench) -> Iterator[Result]:
    """Sends no commands while the line stays open: only the dead-man stops a robot whose host has died."""
    check, timeout = "dead-man of the firmware", bench.protocol.firmware_timeout
    if not bench.has_counters:
        yield warn(check, "the type has no `odometry`: check the wheels by eye")
        return
    with bench.driving(bench.slow_speed) as velocity:
        bench.hold(velocity, bench.pace.settle)
        last = bench.commanded_at
        bench.run(max(bench.pace.silence, 2 * timeout))
        still = not bench.moving
        took = bench.turned_at - last
    stood = f"{took:.2f} s from the last command to the last count; {timeout:g} s is set"
    unsure = _PERIODS / min(bench.protocol.rates.values())
    if not still:
        figure = f"the wheels turn {bench.clock() - last:.1f} s after the last command"
        yield fail(check, figure, "add a dead-man to the sketch: nothing else stops it")
    elif took > timeout + BRAKING + unsure:
        yield fail(check, stood, "shorten the timeout of the sketch, or fix `firmware_timeout`")
    elif took < timeout - unsure - bench.metres_per_count / bench.slow_speed:
        yield warn(check, stood, "commands may stutter: fix `firmware_timeout`")
    else:
        yield ok(check, stood)


def recovers_from_garbage(bench: BoardBench) -> Iterator[Result]:
    """The board answers again after meaningless bytes."""
    bench.port.write(_GARBAGE)
    yield from _recovers(bench, "garbage")


def recovers_from_half_a_frame(bench: BoardBench) -> Iterator[Result]:
    """Sends half a frame, like a cable that is unplugged during a command."""
    whole, _ = bench.encoded_speed(0.0)
    bench.port.write(whole[: len(whole) // 2])
    yield from _recovers(bench, "half a frame")


def _recovers(bench: BoardBench, check: str) -> Iterator[Result]:
    if not bench.has_counters:
        return
    took = first_count(bench)
    if took is None:
        figure = f"no command turns a wheel for {_REACTS:g} s after it"
        yield fail(check, figure, "fix how the sketch reads frames")
    elif took > _LATE:
        yield warn(check, f"a wheel turns {took:.2f} s after it", "the sketch loses more than one command")
    else:
        yield ok(check, f"a wheel turns {took:.2f} s after it")


def first_count(bench: BoardBench) -> float | None:
    """Returns the seconds from a command to the first count; None if none comes."""
    began = bench.clock()
    with bench.driving(bench.slow_speed) as velocity:
        turned = bench.run(_REACTS, velocity, until=lambda: bench.turned_at > began)
        return bench.clock() - began if turned else None


def recovers_from_tx_stop(bench: BoardBench) -> Iterator[Result]:
    """Sends TX_STOP in motion: wheels and topics must stop; then requests the topics again."""
    check = "TX_STOP"
    with bench.driving(bench.slow_speed) as velocity:
        bench.hold(velocity, bench.pace.settle)
        bench.conversation.stop()
        bench.run(BRAKING)
        bench.arrivals.clear()
        bench.run(_SILENCE)
        talks = [name for name, stamps in bench.arrivals.items() if stamps]
        began, known = bench.clock(), len(bench.frames)
        bench.port.write(frames.REQUEST_TOPICS)
        back = bench.run(_REACTS, until=lambda: len(bench.frames) > known)
        took = bench.clock() - began
        turns = bench.still_turns() if back else bench.moving
    if turns:
        yield fail(check, "the wheels keep turning", "fix the sketch: stop on TX_STOP")
    elif not back:
        figure = f"no answer within {_REACTS:g} s to the next topic request"
        yield fail(check, figure, bench.config.serial.hint)
    elif talks:
        yield warn(check, f"it still publishes {', '.join(talks)}", "fix the sketch: it ignores TX_STOP")
    else:
        yield ok(check, f"it stops and is silent; a topic request is answered in {took:.2f} s")


def board_recovers_from_a_reconnect(bench: BoardBench) -> Iterator[Result]:
    """Closes the port in motion and opens it again, like a killed driver; opening it resets an UNO."""
    check, hint = "reconnect", bench.config.serial.hint
    bench.hold((bench.slow_speed, 0.0), bench.pace.settle)
    bench.disconnect()
    try:
        took = bench.negotiate()
    except LinkLostError as error:
        yield fail(check, str(error), f"raise `settle` of the link. {hint}")
        return
    if bench.still_turns():
        yield fail(check, "the wheels keep turning without a driver", "add a dead-man to the sketch")
    else:
        yield ok(check, f"it stops, and announces its topics after {took:.2f} s")
