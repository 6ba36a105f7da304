"""Checks of motion: direction and speed of each wheel, and stops."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.conformance.bench import Bench, Motion, speeds_between
from swarmctl.conformance.polled_bench import PolledBench
from swarmctl.conformance.results import Result, fail, ok, warn

_CLOSE, _FAR = 0.1, 0.25  # of the commanded speed: explained by slip and load, and not explained
_STILL = 0.02  # of the wheels' top speed: a wheel that turns less than this stands


def drives_as_commanded(bench: Bench) -> Iterator[Result]:
    """Drives both ways, slow and at the limit; each wheel alone; a turn on the spot."""
    if not bench.has_counters:
        yield warn("motion", "the type has no position counters: motion cannot be measured")
        return
    built = bench.config.kinematics
    top = min(built.linear_max, built.wheel_speed_max)
    slow, turn = bench.slow_speed, built.wheel_separation
    half = slow / 2
    for name, linear, angular in (
        ("forward, slow", slow, 0.0),
        ("backward, slow", -slow, 0.0),
        ("forward, at the limit", top, 0.0),
        ("backward, at the limit", -top, 0.0),
        ("left wheel alone", half, -slow / turn),
        ("right wheel alone", half, slow / turn),
        ("turn to the left", 0.0, 2 * half / turn),
    ):
        with bench.driving(linear, angular) as velocity:
            motion = bench.measured(velocity)
        yield _verdict(name, motion, bench)


def _verdict(name: str, motion: Motion, bench: Bench) -> Result:
    """Returns the result of one motion, from its counters."""
    figure = "{:+.3f} {:+.3f} m/s of {:+.3f} {:+.3f}".format(*motion.measured, *motion.commanded)
    still = _still(bench) + 2 * motion.resolution
    swapped = (motion.measured[1], motion.measured[0])
    if all(abs(one) <= still for one in motion.measured):
        return fail(name, figure, bench.fixes.still)
    if _ways(swapped, still) == _ways(motion.commanded, still) != _ways(motion.measured, still):
        return fail(name, figure, bench.fixes.swapped)
    if _ways(motion.measured, still) != _ways(motion.commanded, still):
        return fail(name, figure, bench.fixes.wrong)
    ratios = [
        measured / commanded
        for measured, commanded in zip(motion.measured, motion.commanded, strict=True)
        if abs(commanded) > still
    ]
    worst = max(ratios, key=lambda one: abs(one - 1))
    least = min(abs(one) for one in motion.commanded if abs(one) > still)
    off = max(0.0, abs(worst - 1) - 2 * motion.resolution / least)
    if off <= _CLOSE:
        return ok(name, figure)
    doubt = fail if off > _FAR else warn
    return doubt(name, figure, bench.fixes.off(worst))


def _ways(speeds: tuple[float, float], still: float) -> tuple[int, ...]:
    """Forward 1, backward -1, standing 0."""
    return tuple(0 if abs(one) <= still else 1 if one > 0 else -1 for one in speeds)


def stands_after_stop(bench: PolledBench) -> Iterator[Result]:
    """Checks that nothing moves after a confirmed stop."""
    if not bench.has_counters:
        return
    with bench.driving(bench.slow_speed):
        bench.sleep(bench.pace.settle)
    bench.sleep(bench.pace.settle)
    speed, check = _speed(bench), "stands after a stop"
    if speed > _still(bench):
        yield fail(check, f"{speed:.3f} m/s", "the robot confirms a stop but keeps driving: fix `set_speed`")
    else:
        yield ok(check, f"{speed:.3f} m/s")


def stops_by_itself(bench: PolledBench) -> Iterator[Result]:
    """Closes the port in motion without a stop, like a killed driver."""
    if not bench.has_counters:
        return
    with bench.driving(bench.slow_speed) as velocity:
        bench.hold(velocity, bench.pace.settle)
        bench.command(velocity)
        _, before = bench.position()
        bench.disconnect()
        bench.sleep(bench.pace.silence)
        bench.connect()
        _, after = bench.position()
        moving = _speed(bench) > _still(bench)
        seconds = abs(after.left - before.left) / abs(bench.wheel_speeds(velocity)[0])
    yield _dead_man(bench, moving, seconds)


def _dead_man(bench: PolledBench, moving: bool, seconds: float) -> Result:
    check, declared = "driver killed in motion", bench.firmware_dead_man
    if moving:
        figure = f"it still drives after {bench.pace.silence:g} s"
        fix = "the type declares a dead-man: write `firmware_dead_man: false`, or fix the firmware"
    else:
        figure = f"it stops by itself after {seconds:.2f} s"
        fix = "write `firmware_dead_man: true`"
    if moving is not declared:
        return ok(check, f"{figure}, as its type declares")
    return fail(check, figure, fix) if moving else warn(check, figure, fix)


def _speed(bench: PolledBench) -> float:
    """Returns the speed of the faster wheel now, m/s; no commands are sent."""
    before = bench.position()
    bench.sleep(bench.pace.measure / 2)
    return max(map(abs, speeds_between(before, bench.position())))


def _still(bench: Bench) -> float:
    """Returns the speed up to which a wheel stands, m/s."""
    return _STILL * bench.config.kinematics.wheel_speed_max
