"""Checks of how it moves: each wheel the right way, at the right speed, never too fast; and that it stops."""

from __future__ import annotations

import time
from collections.abc import Iterator

from swarmctl.conformance.bench import Bench
from swarmctl.conformance.results import Result, Verdict
from swarmctl.conformance.wheeled import Motion, Wheeled

_CLOSE, _FAR = 0.1, 0.25  # of the ordered speed: what slip and a loaded host explain, and what nothing does
_STILL = 0.02  # of the wheels' top speed: a wheel that turns less than this stands
_SLOW = 0.3  # of the top speed


def drives_as_ordered(bench: Wheeled) -> Iterator[Result]:
    """Both ways, slow and at the limit; each wheel alone; a turn on the spot."""
    if not bench.counts:
        yield Result("motion", Verdict.WARN, "the type has no position counters: nothing can be measured")
        return
    built = bench.config.kinematics
    top = min(built.linear_max, built.wheel_speed_max)
    slow, turn = slowly(bench), built.wheel_separation
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
        yield judged(name, bench.motion(linear, angular), bench)


def judged(name: str, motion: Motion, bench: Wheeled) -> Result:
    """What the counters say of one motion."""
    figure = "{:+.3f} {:+.3f} m/s of {:+.3f} {:+.3f}".format(*motion.measured, *motion.ordered)
    still = _STILL * bench.config.kinematics.wheel_speed_max + 2 * motion.resolution
    swapped = (motion.measured[1], motion.measured[0])
    if all(abs(one) <= still for one in motion.measured):
        return Result(name, Verdict.FAIL, figure, bench.mends.still)
    if _ways(swapped, still) == _ways(motion.ordered, still) != _ways(motion.measured, still):
        return Result(name, Verdict.FAIL, figure, bench.mends.swapped)
    if _ways(motion.measured, still) != _ways(motion.ordered, still):
        return Result(name, Verdict.FAIL, figure, bench.mends.wrong)
    ratios = [
        there / said for there, said in zip(motion.measured, motion.ordered, strict=True) if abs(said) > still
    ]
    worst = max(ratios, key=lambda one: abs(one - 1))
    least = min(abs(said) for said in motion.ordered if abs(said) > still)
    off = max(0.0, abs(worst - 1) - 2 * motion.resolution / least)
    if off <= _CLOSE:
        return Result(name, Verdict.OK, figure)
    return Result(name, Verdict.FAIL if off > _FAR else Verdict.WARN, figure, bench.mends.off(worst))


def _ways(speeds: tuple[float, float], still: float) -> tuple[int, ...]:
    """Forward 1, backward -1, standing 0."""
    return tuple(0 if abs(one) <= still else 1 if one > 0 else -1 for one in speeds)


def stands_after_a_stop(bench: Bench) -> Iterator[Result]:
    """A confirmed stop is one: nothing moves after it."""
    if not bench.counts:
        return
    with bench.driving(slowly(bench), 0.0):
        time.sleep(bench.pace.settle)
    time.sleep(bench.pace.settle)
    moving, figure = _moving(bench)
    if moving:
        mend = "the robot confirms a stop and goes on: mend `set_speed`"
        yield Result("stands after a stop", Verdict.FAIL, figure, mend)
    else:
        yield Result("stands after a stop", Verdict.OK, figure)


def slowly(bench: Wheeled) -> float:
    """A forward speed of no danger, m/s, that its wheels can go."""
    built = bench.config.kinematics
    return max(_SLOW * min(built.linear_max, built.wheel_speed_max), built.wheel_speed_min)


def _moving(bench: Bench) -> tuple[bool, str]:
    """Whether the wheels turn now; nothing is said to them meanwhile."""
    before = bench.counters()
    time.sleep(bench.pace.measure / 2)
    after = bench.counters()
    fastest = max(abs(one) for one in bench.way(before, after)) / (after.stamp - before.stamp)
    return fastest > _STILL * bench.config.kinematics.wheel_speed_max, f"{fastest:.3f} m/s"


def stops_by_itself(bench: Bench) -> Iterator[Result]:
    """What becomes of a robot whose driver is killed: the line is dropped in motion, without a stop."""
    if not bench.counts:
        return
    with bench.driving(slowly(bench), 0.0) as units:
        bench.go_on(units, bench.pace.settle)
        before = bench.counters()
        bench.disconnect()
        time.sleep(bench.pace.silence)
        bench.connect()
        after = bench.counters()
        moving, _ = _moving(bench)
    driven = abs(bench.way(before, after)[0])
    yield _judged_silence(moving, driven * bench.scale.speed_units_per_mps / abs(units[0]), bench)


def _judged_silence(moving: bool, seconds: float, bench: Bench) -> Result:
    check, declared = "driver killed in motion", bench.firmware_dead_man
    if moving and declared:
        return Result(
            check, Verdict.FAIL, f"it still drives after {bench.pace.silence:g} s",
            "the type says that it stops by itself: write `firmware_dead_man: false`, or mend its firmware",
        )  # fmt: skip
    if moving:
        return Result(check, Verdict.OK, f"it still drives after {bench.pace.silence:g} s, as its type says")
    if not declared:
        return Result(
            check, Verdict.WARN, f"it stops by itself after {seconds:.2f} s",
            "good: write `firmware_dead_man: true`",
        )  # fmt: skip
    return Result(check, Verdict.OK, f"it stops by itself after {seconds:.2f} s, as its type says")
