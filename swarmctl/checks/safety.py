"""A robot without orders stands still: how far it drives blind, and whether its commanders let go."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Note, Severity
from swarmctl.spec.edits import mend, remove, set_key
from swarmctl.spec.model import Bluetooth, Program
from swarmctl.spec.settings import RobotSettings
from swarmctl.spec.source import Loc
from swarmctl.spec.words import Value

_BLIND = 0.5  # m; further, and nobody catches it
_SLOW = 1.0  # s; drivers of other robots stop after 0.25 to 0.6 s (diff_drive_controller: 0.5)
_FAST = 1.0  # m/s; walking pace
_TIMEOUT = 0.5  # s, the driver's own

_BUTTONS = ("enable_button", "deadman_button", "axis_deadman")  # a negative one is none
_SWITCHES = ("require_enable_button", "deadman", "dead_man")


def blind_drives(case: Case) -> Iterator[Diagnostic]:
    """SAFE001, SAFE002: how far and how long a robot drives after its last order."""
    base = case.spec.defaults.robot
    for name, robot in case.spec.robots.items():
        kind = case.types[robot.type]
        sketch = kind.foreign(robot.driver)  # which reads none of our settings
        layers = () if sketch else (robot.settings, kind.settings, base)
        timeout = sketch.firmware_timeout if sketch else _first(layers, "command_timeout") or _TIMEOUT
        top = kind.kinematics.wheel_speed_max
        speed = min(_limit(layers) or top, top)
        if timeout * speed <= _BLIND and timeout <= _SLOW:
            continue
        far = timeout * speed > _BLIND
        loc = _place(case, name, base)
        yield Diagnostic(
            "SAFE001" if far else "SAFE002",
            f"robot `{name}` drives on for {timeout:g} s after its last order"
            + (f": {timeout * speed:.2g} m at {speed:.2g} m/s" if far else ""),
            case.span(*loc) if loc else case.span("robots", name, key=True),
            severity=Severity.WARNING,
            label="blind all the way" if far else f"{_SLOW:g} s is long for a robot",
            notes=(Note(case.span("robots", name, key=True), "this robot"),)
            if loc[:1] != ("robots",) and loc
            else (),
            help=("let its sketch stop it sooner, and say so in its type: `firmware_timeout`",)
            if sketch
            else (f"let it stop sooner: command_timeout: {_sooner(speed):g}",)
            if timeout > _TIMEOUT
            else ("drive slower: settings: {limits: {linear: ...}}, or let it stop sooner",),
        )


def _sooner(speed: float) -> float:
    return min(_TIMEOUT, max(0.1, int(_BLIND / speed * 10) / 10))


def _first(layers: Sequence[RobotSettings], key: str) -> float | None:
    return next((value for one in layers if (value := getattr(one, key)) is not None), None)


def _limit(layers: Sequence[RobotSettings]) -> float | None:
    return next((one.limits.linear for one in layers if one.limits.linear is not None), None)


def _place(case: Case, name: str, base: RobotSettings) -> Loc:
    """Where the spec sets the timeout of a robot; nothing if its type or swarmctl does."""
    robot = case.spec.robots[name]
    if case.types[robot.type].foreign(robot.driver):
        return ()
    return case.said_timeout(name)


def disarmed(case: Case) -> Iterator[Diagnostic]:
    """SAFE003: a joystick or a keyboard whose dead-man is switched off; swarmctl's own have no switch."""
    for name, program in case.spec.programs.items():
        for key, value in program.params.items() if program.use is None else ():
            if not _is_off(program, key, value):
                continue
            loc = ("programs", name, "params")
            repeats = key == "repeat_rate"
            yield Diagnostic(
                "SAFE003",
                f"program `{name}` repeats its last order for ever"
                if repeats
                else f"program `{name}` commands without a dead-man",
                case.span(*loc, key),
                label="and nobody holds a key" if repeats else "switches it off",
                help=("add `key_timeout: 0.5`, the time after which a key counts as let go",)
                if repeats
                else ("remove it: the robot moves while somebody holds the button, and no longer",),
                fix=mend("add `key_timeout: 0.5`", set_key(case.source, loc, "key_timeout", 0.5, after=key))
                if repeats
                else mend(f"remove `{key}`", remove(case.source, (*loc, key))),
            )


def _is_off(program: Program, key: str, value: Value) -> bool:
    """Whether a parameter takes away the dead-man (teleop_twist_joy, teleop_twist_keyboard)."""
    if key in _SWITCHES:
        return value is False
    if isinstance(value, (bool, str)):
        return False
    if key in _BUTTONS:
        return value < 0
    waits = program.params.get("key_timeout", 0)
    return key == "repeat_rate" and program.package == "teleop_twist_keyboard" and value > 0 and waits == 0


def runaways(case: Case) -> Iterator[Diagnostic]:
    """SAFE004: a fast robot keeps its last speed when its radio line breaks."""
    base = case.spec.defaults.robot
    for index, link in case.lines:
        robot = case.spec.robots[link.robot]
        kind = case.types[robot.type]
        if kind.firmware_dead_man or not isinstance(link, Bluetooth):
            continue
        top = kind.kinematics.wheel_speed_max
        speed = min(_limit((robot.settings, kind.settings, base)) or top, top)
        if speed > _FAST:
            yield Diagnostic(
                "SAFE004",
                f"robot `{link.robot}` keeps on at up to {speed:.2g} m/s when its Bluetooth line breaks",
                case.span("links", index, "robot"),
                severity=Severity.WARNING,
                label="nothing on the robot stops it",
                notes=(Note(case.span("robots", link.robot, "type"), "has no dead-man in its firmware"),),
                help=(
                    f"drive slower: settings: {{limits: {{linear: {_FAST:g}}}}}",
                    "or let a computer ride on it, joined by a cable",
                ),
            )


RULES: tuple[Rule, ...] = (blind_drives, disarmed, runaways)
