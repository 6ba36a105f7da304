"""How far and how long a robot drives after its last command, and programs without a dead-man."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.field_types import Parameter
from swarmctl.links.bluetooth_link import Bluetooth
from swarmctl.linter.context import RuleContext, rule
from swarmctl.robot_types.settings import RobotSettings
from swarmctl.spec.program_model import Program
from swarmctl.yamltext.edits import make_fix, remove, set_key
from swarmctl.yamltext.source import Loc

_MAX_DISTANCE = 0.5  # m
_MAX_TIMEOUT = 1.0  # s; other drivers stop after 0.25 to 0.6 s (diff_drive_controller: 0.5)
_FAST = 1.0  # m/s; walking pace
_TIMEOUT = 0.5  # s, the driver's own

_BUTTONS = ("enable_button", "deadman_button", "axis_deadman")  # a negative number disables it
_SWITCHES = ("require_enable_button", "deadman", "dead_man")


@rule("SAFE001", "SAFE002")
def stopping_distances(context: RuleContext) -> Iterator[Diagnostic]:
    """A robot that drives too far or too long after its last command."""
    base = context.spec.defaults.robot
    for name, robot in context.spec.robots.items():
        driver = context.ros_drivers.get(name)
        ungated = driver is not None and driver.ungated  # then nothing reads its settings
        timeout, top = context.command_timeouts[name], context.motions[robot.type].axes[0]
        if driver is not None and ungated:
            timeout = driver.stops_after or 0.0  # not known
        if timeout * top <= _MAX_DISTANCE and timeout <= _MAX_TIMEOUT:
            continue
        limit = None if ungated else _limit(context.document.settings_layers(name)[::-1])
        speed = min(limit or top, top)
        if timeout * speed <= _MAX_DISTANCE and timeout <= _MAX_TIMEOUT:
            continue
        far = timeout * speed > _MAX_DISTANCE
        loc = _place(context, name, base)
        yield Diagnostic(
            "SAFE001" if far else "SAFE002",
            f"robot `{name}` drives on for {timeout:g} s after its last command"
            + (f": {timeout * speed:.2g} m at {speed:.2g} m/s" if far else ""),
            context.span(*loc) if loc else context.span("robots", name, key=True),
            label=f"more than {_MAX_DISTANCE:g} m" if far else f"more than {_MAX_TIMEOUT:g} s",
            notes=(Note(context.span("robots", name, key=True), "this robot"),)
            if loc[:1] != ("robots",) and loc
            else (),
            help=("shorten the timeout of its driver, or remove `ungated`",)
            if ungated
            else (f"shorten its timeout: command_timeout: {_sooner(speed):g}",)
            if timeout > _TIMEOUT
            else ("limit its speed: settings: {limits: {linear: ...}}, or shorten its `command_timeout`",),
        )


def _sooner(speed: float) -> float:
    return min(_TIMEOUT, max(0.1, int(_MAX_DISTANCE / speed * 10) / 10))


def _limit(layers: Sequence[RobotSettings]) -> float | None:
    return next((one.limits.linear for one in layers if one.limits.linear is not None), None)


def _place(context: RuleContext, name: str, base: RobotSettings) -> Loc:
    """Returns the place of a robot's timeout in the spec; empty if its type or swarmctl sets it."""
    driver = context.ros_drivers.get(name)
    return () if driver is not None and driver.ungated else context.command_timeout_loc(name)


@rule("SAFE003")
def disabled_dead_men(context: RuleContext) -> Iterator[Diagnostic]:
    """A joystick or keyboard program with its dead-man disabled; the shipped programs have no such switch."""
    for name, program in context.spec.programs.items():
        kind, values = program.named_values
        for key, value in values.items() if program.use is None else ():
            if not _is_off(program, key, value):
                continue
            loc = ("programs", name, kind)
            repeats = key == "repeat_rate"
            yield Diagnostic(
                "SAFE003",
                f"program `{name}` repeats its last command forever"
                if repeats
                else f"program `{name}` commands without a dead-man",
                context.span(*loc, key),
                label="even if no key is pressed" if repeats else "disables the dead-man",
                help=("add `key_timeout: 0.5`, the time in seconds after which a key counts as released",)
                if repeats
                else ("remove it, so that the robot moves only while the button is pressed",),
                fix=make_fix(
                    "add `key_timeout: 0.5`",
                    set_key(context.source, loc, "key_timeout", 0.5, after=key),
                    safe=False,
                )
                if repeats
                else make_fix(f"remove `{key}`", remove(context.source, (*loc, key)), safe=False),
            )


def _is_off(program: Program, key: str, value: Parameter) -> bool:
    """True if a parameter disables the dead-man (teleop_twist_joy, teleop_twist_keyboard)."""
    if key in _SWITCHES:
        return value is False
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return False
    if key in _BUTTONS:
        return value < 0
    waits = program.params.get("key_timeout", 0)
    return key == "repeat_rate" and program.package == "teleop_twist_keyboard" and value > 0 and waits == 0


@rule("SAFE004")
def runaways(context: RuleContext) -> Iterator[Diagnostic]:
    """A fast robot that keeps its last speed when its Bluetooth link fails."""
    for index, link, kind in context.native_lines:
        if kind.firmware_dead_man or not isinstance(link, Bluetooth):
            continue
        top = kind.kinematics.wheel_speed_max
        speed = min(_limit(context.document.settings_layers(link.robot)[::-1]) or top, top)
        if speed > _FAST:
            yield Diagnostic(
                "SAFE004",
                f"robot `{link.robot}` keeps driving at up to {speed:.2g} m/s when its Bluetooth link fails",
                context.span("links", index, "robot"),
                label="no stop without the link",
                notes=(Note(context.span("robots", link.robot, "type"), "no dead-man in its firmware"),),
                help=(
                    f"limit its speed: settings: {{limits: {{linear: {_FAST:g}}}}}",
                    "or mount a computer on the robot and connect it by cable",
                ),
            )
