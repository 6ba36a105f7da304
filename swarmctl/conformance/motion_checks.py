"""Checks of motion: direction and speed of each wheel, and stops."""

from __future__ import annotations

import time
from collections.abc import Iterator

from swarmctl.conformance.motion_base import Motion, Wheeled
from swarmctl.conformance.results import Result, Verdict
from swarmctl.conformance.robot_bench import Bench

_CLOSE, _FAR = 0.1, 0.25  # of the commanded speed: explained by slip and load, and not explained
_STILL = 0.02  # of the wheels' top speed: a wheel that turns less than this stands
_SLOW = 0.3  # of the top speed


def drives_as_commanded(bench: Wheeled) -> Iterator[Result]:
    """Drives both ways, slow and at the limit; each wheel alone; a turn on the spot."""
    if not bench.has_counters:
        yield Result("motion", Verdict.WARN, "the type has no position counters: motion cannot be measured")
        return
    built = bench.config.kinematics
    top = min(built.linear_max, built.wheel_speed_max)
    slow, turn = slow_speed(bench), built.wheel_separation
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
        yield verdict_of(name, bench.motion(linear, angular), bench)


def verdict_of(name: str, motion: Motion, bench: Wheeled) -> Result:
    """Returns the result of one motion, from its counters."""
    figure = "{:+.3f} {:+.3f} m/s of {:+.3f} {:+.3f}".format(*motion.measured, *motion.commanded)
    still = _STILL * bench.config.kinematics.wheel_speed_max + 2 * motion.resolution
    swapped = (motion.measured[1], motion.measured[0])
    if all(abs(one) <= still for one in motion.measured):
        return Result(name, Verdict.FAIL, figure, bench.fixes.still)
    if _ways(swapped, still) == _ways(motion.commanded, still) != _ways(motion.measured, still):
        return Result(name, Verdict.FAIL, figure, bench.fixes.swapped)
    if _ways(motion.measured, still) != _ways(motion.commanded, still):
        return Result(name, Verdict.FAIL, figure, bench.fixes.wrong)
    ratios = [
        measured / commanded
        for measured, commanded in zip(motion.measured, motion.commanded, strict=True)
        if abs(commanded) > still
    ]
    worst = max(ratios, key=lambda one: abs(one - 1))
    least = min(abs(one) for one in motion.commanded if abs(one) > still)
    off = max(0.0, abs(worst - 1) - 2 * motion.resolution / least)
    if off <= _CLOSE:
        return Result(name, Verdict.OK, figure)
    return Result(name, Verdict.FAIL if off > _FAR else Verdict.WARN, figure, bench.fixes.off(worst))


def _ways(speeds: tuple[float, float], still: float) -> tuple[int, ...]:
    """Forward 1, backward -1, standing 0."""
    return tuple(0 if abs(one) <= still else 1 if one > 0 else -1 for one in speeds)


def stands_after_stop(bench: Bench) -> Iterator[Result]:
    """Checks that nothing moves after a confirmed stop."""
    if not bench.has_counters:
        return
    with bench.driving(slow_speed(bench), 0.0):
        time.sleep(bench.pace.settle)
    time.sleep(bench.pace.settle)
    moving, figure = _moving(bench)
    if moving:
        fix = "the robot confirms a stop but keeps driving: fix `set_speed`"
        yield Result("stands after a stop", Verdict.FAIL, figure, fix)
    else:
        yield Result("stands after a stop", Verdict.OK, figure)


def slow_speed(bench: Wheeled) -> float:
    """Returns a slow forward speed that the wheels can reach, m/s."""
    built = bench.config.kinematics
    return max(_SLOW * min(built.linear_max, built.wheel_speed_max), built.wheel_speed_min)


def _moving(bench: Bench) -> tuple[bool, str]:
    """Returns whether the wheels turn now, and their speed; no commands are sent."""
    before = bench.counters()
    time.sleep(bench.pace.measure / 2)
    after = bench.counters()
    fastest = max(abs(one) for one in bench.distance(before, after)) / (after.stamp - before.stamp)
    return fastest > _STILL * bench.config.kinematics.wheel_speed_max, f"{fastest:.3f} m/s"


def stops_by_itself(bench: Bench) -> Iterator[Result]:
    """Closes the port in motion without a stop, like a killed driver."""
    if not bench.has_counters:
        return
    with bench.driving(slow_speed(bench), 0.0) as units:
        bench.hold(units, bench.pace.settle)
        before = bench.counters()
        bench.disconnect()
        time.sleep(bench.pace.silence)
        bench.connect()
        after = bench.counters()
        moving, _ = _moving(bench)
    driven = abs(bench.distance(before, after)[0])
    yield _dead_man_result(moving, driven * bench.scale.speed_units_per_mps / abs(units[0]), bench)


def _dead_man_result(moving: bool, seconds: float, bench: Bench) -> Result:
    check, declared = "driver killed in motion", bench.firmware_dead_man
    if moving and declared:
        return Result(
            check, Verdict.FAIL, f"it still drives after {bench.pace.silence:g} s",
            "the type declares a dead-man: write `firmware_dead_man: false`, or fix the firmware",
        )  # fmt: skip
    if moving:
        return Result(
            check, Verdict.OK, f"it still drives after {bench.pace.silence:g} s, as its type declares"
        )
    if not declared:
        return Result(
            check, Verdict.WARN, f"it stops by itself after {seconds:.2f} s",
            "write `firmware_dead_man: true`",
        )  # fmt: skip
    return Result(check, Verdict.OK, f"it stops by itself after {seconds:.2f} s, as its type declares")
