"""The programs that swarmctl ships, the buttons, axes and speeds of gamepads, and who wins over a person."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from swarmctl.diagnostics import Diagnostic, Note, Span
from swarmctl.linter.context import RuleContext, rule
from swarmctl.rules.authority import checks_commanders
from swarmctl.spec.catalog import shipped
from swarmctl.spec.program_model import Program
from swarmctl.suggest import did_you_mean, guess
from swarmctl.swarm.shipped_programs import SHIPPED
from swarmctl.swarm.topics import JOY_TYPE
from swarmctl.yamltext.edits import make_fix, rename_key, replace_value


@rule("PROG011")
def unknown_settings(context: RuleContext) -> Iterator[Diagnostic]:
    """An unknown parameter of a shipped program."""
    for name, program in context.spec.programs.items():
        known = shipped().get(program.use or "")
        for key in program.params if known is not None else ():
            if known is None or key in known:
                continue
            loc = ("programs", name, "params", key)
            meant = guess(key, known)
            near = meant.only
            yield Diagnostic(
                "PROG011",
                f"`{program.use}` has no parameter `{key}`",
                context.span(*loc, key=True),
                label="has no effect",
                help=did_you_mean(key, known, "its parameters are"),
                fix=make_fix(f"write `{near}`", rename_key(context.source, loc, near), safe=meant.certain)
                if near and near not in program.params
                else None,
            )


@rule("PROG012")
def invalid_settings(context: RuleContext) -> Iterator[Diagnostic]:
    """A parameter of a shipped program with an invalid value."""
    for name, program in context.spec.programs.items():
        known = shipped().get(program.use or "", {})
        for key, value in program.params.items() if known else ():
            if key not in known or known[key].takes(value):
                continue
            loc, setting = ("programs", name, "params", key), known[key]
            bare = isinstance(value, str) and (number := _number(value)) is not None and setting.takes(number)
            yield Diagnostic(
                "PROG012",
                f"`{key}` of `{program.use}` must be {setting.range}",
                context.span(*loc),
                label="a number in quotes is text" if bare else "invalid value",
                help=(f"`{key}`: {setting.meaning[0].lower()}{setting.meaning[1:]}",),
                fix=make_fix("remove the quotes", replace_value(context.source, loc, number), safe=True)
                if bare
                else None,
            )


def _number(text: str) -> int | float | None:
    with contextlib.suppress(ValueError):
        return int(text)
    with contextlib.suppress(ValueError):
        return float(text)
    return None


@rule("PROG013")
def programs_without_robot(context: RuleContext) -> Iterator[Diagnostic]:
    """A joystick or keyboard program without a robot in `control`."""
    commanders = {control.by for control in context.spec.control} if context.spec.programs else set()
    for name, program in context.spec.programs.items():
        if program.use in shipped() and name not in commanders:
            yield Diagnostic(
                "PROG013",
                f"program `{name}` has no robot to command",
                context.span("programs", name, key=True),
                label="not in `control`",
                help=(f"add to `control`: {{by: {name}, of: [...]}}",),
            )


_TURBO = "the turbo scales always hold, also where slow driving was meant"
_SELECT = "it counts only while the dead-man button is free, so it would never choose a robot"
_AXES = "one movement of the stick would drive and turn at once"


@dataclass(frozen=True)
class _Pad:
    """The parameters of a gamepad program, with their defaults."""

    controls: tuple[tuple[str, str, str, str], ...]  # button or axis; two parameters; why they differ
    turbo: str
    scales: tuple[tuple[str, str], ...]  # without and with turbo
    defaults: Mapping[str, float]


_TELEOP_JOY = _Pad(
    controls=(
        ("button", "deadman_button", "turbo_button", _TURBO),
        ("button", "deadman_button", "select_button", _SELECT),
        ("axis", "linear_axis", "angular_axis", _AXES),
    ),
    turbo="turbo_button",
    scales=(("linear_scale", "turbo_linear_scale"), ("angular_scale", "turbo_angular_scale")),
    defaults={},  # in settings.yaml
)
# wiki.ros.org/teleop_twist_joy
_TWIST_JOY = _Pad(
    controls=(
        ("button", "enable_button", "enable_turbo_button", _TURBO),
        ("axis", "axis_linear", "axis_angular", _AXES),
    ),
    turbo="enable_turbo_button",
    scales=(("scale_linear", "scale_linear_turbo"), ("scale_angular", "scale_angular_turbo")),
    defaults={
        "enable_button": 0, "enable_turbo_button": -1, "axis_linear": 1, "axis_angular": 0,
        "scale_linear": 0.5, "scale_linear_turbo": 1.0, "scale_angular": 0.5, "scale_angular_turbo": 1.0,
    },
)  # fmt: skip
_NESTED = {
    "axis_linear": "axis_linear/x",
    "axis_angular": "axis_angular/yaw",
    "scale_linear": "scale_linear/x",
    "scale_linear_turbo": "scale_linear_turbo/x",
    "scale_angular": "scale_angular/yaw",
    "scale_angular_turbo": "scale_angular_turbo/yaw",
}


@dataclass(frozen=True)
class _Settings:
    """The numbers that one program gets, and where they stand."""

    context: RuleContext
    name: str
    program: Program
    pad: _Pad

    def value(self, key: str) -> float:
        """Returns the number of a parameter, its default if the spec has no number for it."""
        given = self.program.params.get(self._written(key))
        if isinstance(given, (int, float)) and not isinstance(given, bool):
            return given
        if self.program.use is not None:
            return float(shipped()[self.program.use][key].default)
        return self.pad.defaults[key]

    def span(self, key: str) -> Span:
        """Returns where a parameter stands; of a default, the program."""
        written = self._written(key)
        loc = ("programs", self.name)
        return self.context.span(*loc, *(("params", written) if written in self.program.params else ()))

    def given(self, key: str) -> bool:
        """Returns whether the spec sets the parameter."""
        return self._written(key) in self.program.params

    def shown(self, key: str) -> str:
        """Returns the value, marked where it is a default."""
        return f"{self.value(key):g}{'' if self.given(key) else ', the default'}"

    def _written(self, key: str) -> str:
        nested = _NESTED.get(key, key)
        return nested if nested in self.program.params else key


def _pads(context: RuleContext) -> Iterator[_Settings]:
    for name, program in context.spec.programs.items():
        if program.use == "teleop-joy":
            yield _Settings(context, name, program, _TELEOP_JOY)
        elif program.package == "teleop_twist_joy" and program.launch is None:
            yield _Settings(context, name, program, _TWIST_JOY)


@rule("PROG017")
def shared_controls(context: RuleContext) -> Iterator[Diagnostic]:
    """One button or axis of a gamepad for two functions."""
    for pad in _pads(context):
        for what, first, second, why in pad.pad.controls:
            number = pad.value(first)
            if number < 0 or number != pad.value(second):
                continue
            at, other = (second, first) if pad.given(second) else (first, second)
            yield Diagnostic(
                "PROG017",
                f"`{first}` and `{second}` of program `{pad.name}` are both {what} {number:g}",
                pad.span(at),
                label=f"`{other}` is {pad.shown(other)}",
                notes=(Note(pad.span(other), f"`{other}`"),) if pad.given(other) else (),
                help=(f"choose another {what} for one of them: {why}",),
            )


@rule("PROG018")
def turbo_that_reverses(context: RuleContext) -> Iterator[Diagnostic]:
    """Turbo scales that turn the direction round."""
    for pad in _pads(context):
        for slow, fast in pad.pad.scales if pad.value(pad.pad.turbo) >= 0 else ():
            plain, turbo = pad.value(slow), pad.value(fast)
            if plain * turbo >= 0:
                continue
            at, other = (fast, slow) if pad.given(fast) else (slow, fast)
            yield Diagnostic(
                "PROG018",
                f"the turbo button of program `{pad.name}` reverses the direction",
                pad.span(at),
                label=f"`{other}` is {pad.shown(other)}",
                notes=(Note(pad.span(other), f"`{other}`"),) if pad.given(other) else (),
                help=(f"set `{fast}` too, such as {-turbo:g}",),
            )


@rule("PROG024", by_distro=True)
def silent_gamepads(context: RuleContext) -> Iterator[Diagnostic]:
    """A joy_node that repeats too seldom: a stick that is held still counts as a gamepad gone."""
    read = {one.owner: one.topic for one in context.endpoints if one.type == JOY_TYPE and not one.publishes}
    timeouts: dict[str, tuple[float, str]] = {}
    for pad in _pads(context):
        stops = _stop(context, pad) if pad.name in read else None
        if stops is not None:
            timeouts[read[pad.name]] = min(stops, timeouts.get(read[pad.name], stops))
    usual = 0.0 if context.can("ros1-nodes") else 20.0
    for one in context.endpoints if timeouts else ():
        program = context.spec.programs[one.owner]
        if not one.publishes or one.topic not in timeouts or program.executable != "joy_node":
            continue
        timeout, who = timeouts[one.topic]
        value = program.params.get("autorepeat_rate", usual)
        is_number = isinstance(value, (int, float))  # roscpp takes its own default for another type
        rate = value if isinstance(value, (int, float)) else 0.0
        if program.package == "joy" and rate * timeout <= 1:
            given = "autorepeat_rate" in program.params
            loc = ("programs", one.owner, *(("params", "autorepeat_rate") if given else ()))
            yield Diagnostic(
                "PROG024",
                f"program `{one.owner}` repeats nothing in time, and {who} stops after {timeout:g} s",
                context.span(*loc, key=not given),
                label=f"repeats {rate:g} times a second" if is_number else "joy_node expects a number",
                help=(
                    "add to its params: autorepeat_rate: 20.0"
                    if is_number
                    else "write a number without quotes, such as 20.0",
                ),
            )


def _stop(context: RuleContext, pad: _Settings) -> tuple[float, str] | None:
    """Returns after how many seconds of silence something stops, and what: the program, else a robot."""
    if pad.program.use is not None:
        return pad.value("joy_timeout"), f"`{pad.name}`"
    control = (one for one in context.spec.control if one.by == pad.name)
    robots = [robot for one in control for robot in one.of if checks_commanders(context, robot)]
    first = min(robots, key=lambda one: context.command_timeouts[one], default=None)
    return None if first is None else (context.command_timeouts[first], f"robot `{first}`")


_BY_HAND = ("teleop_twist_joy", "teleop_twist_keyboard", "joy_teleop", "key_teleop")


@rule("AUTH014")
def outranked_persons(context: RuleContext) -> Iterator[Diagnostic]:
    """A program that wins over everybody who drives a robot by hand; one finding for each entry."""
    programs = context.spec.programs
    by_hand = {name for name, one in programs.items() if one.use in SHIPPED or one.package in _BY_HAND}
    highest: dict[str, tuple[int, int]] = {}  # of those who drive a robot by hand, with the entry
    for index, control in enumerate(context.spec.control if by_hand else ()):
        if control.by in by_hand:
            for robot in control.of:
                highest[robot] = max(highest.get(robot, (-1, -1)), (control.priority, index))
    for index, control in enumerate(context.spec.control if highest else ()):
        if control.by not in programs or control.by in by_hand:
            continue
        robots = [one for one in control.of if highest.get(one, (255, 0))[0] < control.priority]
        checked = [one for one in robots if checks_commanders(context, one)]
        if checked:
            priority, other = highest[checked[0]]
            person = context.spec.control[other].by
            more = f" and {len(checked) - 1} more" if len(checked) > 1 else ""
            yield Diagnostic(
                "AUTH014",
                f"nobody takes over `{checked[0]}`{more} by hand while `{control.by}` commands: "
                f"it wins over `{person}`",
                context.span("control", index, "priority"),
                label=f"higher than the {priority} of `{person}`",
                notes=(Note(context.span("control", other, "by"), "drives by hand"),),
                help=(
                    f"give `{person}` a higher priority than `{control.by}`",
                    f"or ignore this, if `{control.by}` only prevents collisions and is silent otherwise",
                ),
            )
