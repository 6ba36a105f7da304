"""Microcontroller boards: topics within rosserial's limits, sketches that the board can run."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.analysis.rosserial_load import PATIENCE, Carried, RosserialBudget
from swarmctl.analysis.sketch_limits import good_bauds, most_pulses, wrong_baud
from swarmctl.diagnostics import Diagnostic
from swarmctl.linter.context import RuleContext, rule
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.sketch_settings import DEFAULTS, Firmware, boards, clashes, size_of
from swarmctl.rules.serial_lines import BAUDS, meant_baud, near_bauds
from swarmctl.suggest import guess, suggestion
from swarmctl.yamltext.edits import make_fix, replace_value
from swarmctl.yamltext.source import Loc


@rule("BOARD001")
def known_boards(context: RuleContext) -> Iterator[Diagnostic]:
    """A board with unknown limits."""
    for loc, board in _named(context):
        if board not in boards():
            meant = guess(board, boards())
            edits = replace_value(context.source, (*loc, "board"), meant.only) if meant.only else ()
            yield Diagnostic(
                "BOARD001",
                f"unknown board `{board}`",
                context.span(*loc, "board"),
                label="not in the list of boards",
                help=suggestion(meant, boards(), "known boards"),
                fix=make_fix(f"write `{meant.only}`", edits, safe=meant.certain),
            )


def _named(context: RuleContext) -> Iterator[tuple[Loc, str]]:
    """Yields the boards of programs and of the spec's own robot types, with their places."""
    for name, program in context.spec.programs.items():
        if program.board is not None:
            yield ("programs", name), program.board
    for name, kind in context.spec.types.items():
        if isinstance(kind, RobotType) and kind.sketch is not None:
            yield ("types", name, "protocol"), kind.sketch.board


def _budgets(context: RuleContext) -> Iterator[RosserialBudget]:
    """Yields one budget per sketch: robots with the same type and baud rate have the same sketch."""
    alike: set[tuple[str, int]] = set()
    for budget in context.board_budgets:
        if budget.kind == "robot":
            sketch = (context.spec.robots[budget.owner].type, budget.baud)
            if sketch in alike:
                continue
            alike.add(sketch)
        yield budget


@rule("BOARD002")
def topic_counts(context: RuleContext) -> Iterator[Diagnostic]:
    """More publishers or subscribers than the client library supports."""
    for budget in _budgets(context):
        counts = (
            ("publishes", "publishes", budget.published, budget.board.publishers),
            ("subscribes", "subscribes to", budget.subscribed, budget.board.subscribers),
        )
        for key, verb, count, most in counts:
            if count > most:
                yield Diagnostic(
                    "BOARD002",
                    f"{budget.kind} `{budget.owner}` {verb} {count} topics; its {budget.name} allows {most}",
                    context.span(*budget.loc, key, most),
                    label=f"topic {most + 1}",
                    help=("combine several values in one topic, or use a larger board",),
                )


@rule("BOARD003", "BOARD004")
def buffers(context: RuleContext) -> Iterator[Diagnostic]:
    """A message larger than the board's buffer, or of unknown size."""
    for budget in _budgets(context):
        for one in budget.topics:
            limit = budget.largest_message(one)
            if one.bytes is None:
                yield _unknown(context, budget, one)
            elif one.bytes > limit:
                verb = "sends" if one.sent else "receives"
                yield Diagnostic(
                    "BOARD003",
                    f"{one.topic.type} with {one.bytes} bytes is too large: the {budget.name} of "
                    f"`{budget.owner}` {verb} {limit} bytes at most",
                    context.span(*budget.loc, one.key, one.index),
                    label=f"{one.bytes - limit} bytes above the limit",
                    help=(_smaller(one),),
                )


def _smaller(one: Carried) -> str:
    if one.topic.type == "nav_msgs/Odometry":
        return "publish wheel ticks (std_msgs/Int32) on the board, and odometry from a program on the host"
    return "use a smaller type (no covariance, no header), split it, or use a board with larger buffers"


def _unknown(context: RuleContext, budget: RosserialBudget, one: Carried) -> Diagnostic:
    known = size_of(one.topic.type)
    limit = budget.largest_message(one)
    what = (
        f"the size of `{one.topic.type}` is unknown"
        if known is None
        else f"the size of {one.topic.type} depends on its content ({known.bytes} bytes when empty)"
    )
    return Diagnostic(
        "BOARD004",
        f"{what}; the {budget.name} of `{budget.owner}` is limited to {limit} bytes",
        context.span(*budget.loc, one.key, one.index, "type"),
        label="may not fit",
        help=("set `size`, its maximum in bytes, beside the type",),
    )


@rule("BOARD005")
def board_lines(context: RuleContext) -> Iterator[Diagnostic]:
    """The declared rates exceed the capacity of the board's serial link."""
    for budget in _budgets(context):
        if budget.share > 1:
            yield Diagnostic(
                "BOARD005",
                f"the topics of `{budget.owner}` need {budget.needed:.0f} B/s one way, its link carries "
                f"{budget.available:.0f} B/s: {budget.share:.0%}",
                context.span(*budget.loc, "board"),
                label=f"at {budget.baud} baud",
                help=(
                    f"lower the rates, use smaller messages, or raise {_baud(budget, '...')} on both sides",
                ),
            )


def _baud(budget: RosserialBudget, value: object) -> str:
    """Returns the setting of the baud rate as text for a spec."""
    return f"`params: {{baud: {value}}}`" if budget.kind == "program" else f"`baud: {value}` of its link"


@rule("BOARD007")
def slow_frames(context: RuleContext) -> Iterator[Diagnostic]:
    """A message that takes longer to the board than the board waits for it."""
    for budget in _budgets(context):
        for one in budget.topics:
            if one.sent or one.bytes is None or one.bytes > budget.largest_message(one):
                continue
            seconds = budget.seconds(one)
            if seconds > budget.patience:
                faster = next((baud for baud in BAUDS if seconds * budget.baud / baud < PATIENCE), BAUDS[-1])
                yield Diagnostic(
                    "BOARD007",
                    f"{one.topic.type} takes {seconds * 1000:.0f} ms to the board of `{budget.owner}`, which "
                    f"drops incomplete frames after {budget.patience * 1000:.0f} ms",
                    context.span(*budget.loc, one.key, one.index),
                    label=f"{one.bytes} bytes at {budget.baud} baud",
                    help=(f"set {_baud(budget, faster)} here and in the sketch, or use a smaller type",),
                )


@rule("BOARD008")
def announcements(context: RuleContext) -> Iterator[Diagnostic]:
    """A topic name and type too long for the board's announcement frame."""
    for budget in _budgets(context):
        for one in budget.topics:
            if one.announcement > budget.board.sends:
                yield Diagnostic(
                    "BOARD008",
                    f"the {budget.name} of `{budget.owner}` cannot announce `{one.topic.topic}`: "
                    f"the frame takes {one.announcement} bytes, the buffer has {budget.board.sends}",
                    context.span(*budget.loc, one.key, one.index, "topic"),
                    label="name and type are too long",
                    help=(
                        "use a shorter name in the sketch"
                        + (", and `remap` it here" if budget.kind == "program" else ""),
                    ),
                )


@rule("BOARD009")
def odd_board_bauds(context: RuleContext) -> Iterator[Diagnostic]:
    """A non-standard baud rate of a board."""
    for name, program in context.spec.programs.items():
        baud = program.params.get("baud")
        if program.board is None or baud is None or (isinstance(baud, int) and baud in BAUDS):
            continue
        near = (
            [int(baud)] if str(baud) in map(str, BAUDS) else near_bauds(baud) if isinstance(baud, int) else []
        )
        place = ("programs", name, "params", "baud")
        yield Diagnostic(
            "BOARD009",
            f"`{baud}` is not a standard baud rate; no message of the board of `{name}` would arrive",
            context.span(*place),
            label="baud",
            help=(meant_baud(near) or "write the rate of its sketch, such as 57600 or 115200",),
            fix=make_fix(
                f"write {near[0]}",
                replace_value(context.source, place, near[0]),
                safe=str(near[0]) == str(baud),
            )
            if len(near) == 1
            else None,
        )


@rule("BOARD010")
def pins_used_twice(context: RuleContext) -> Iterator[Diagnostic]:
    """A pin with two uses."""
    general = context.spec.defaults.robot
    for name, kind in context.native_robots.items():
        if kind.sketch is None or not kind.sketch.firmware:
            continue
        robot = context.spec.robots[name]
        layers = {("robots", name, "settings"): robot.settings, ("defaults", "robot"): general}
        declared = {loc: one.firmware for loc, one in layers.items() if "firmware" in one.model_fields_set}
        if not declared:
            continue
        wiring = context.settings_of(name).firmware
        for second, first, pin in clashes(wiring):
            places = ((loc, one) for loc in declared for one in (second, first) if _sets(declared[loc], one))
            loc, place = next(places, ((), ()))
            if place:
                other = first if place == second else second
                yield Diagnostic(
                    "BOARD010",
                    f"pin {pin} of the board of robot `{name}` has two uses",
                    context.span(*loc, "firmware", *place),
                    label=f"also used as `{'.'.join(other)}`",
                    help=("assign another pin to one of them; docs/firmware.md shows the wiring",),
                )


def _sets(layer: Firmware, place: tuple[str, str]) -> bool:
    side, pin = place
    return getattr(getattr(layer, side), pin) is not None


@rule("BOARD011")
def wiring_without_sketch(context: RuleContext) -> Iterator[Diagnostic]:
    """Wiring for a robot whose sketch swarmctl does not generate."""
    for name, robot in context.spec.robots.items():
        if "firmware" not in robot.settings.model_fields_set:
            continue
        kind = context.native_robots.get(name)
        if kind is None or kind.sketch is None or kind.sketch.firmware is None:
            yield Diagnostic(
                "BOARD011",
                f"swarmctl generates no sketch for robot `{name}`, so `firmware` has no effect",
                context.span("robots", name, "settings", "firmware", key=True),
                label=f"`{robot.type}` has no `protocol.firmware`",
                help=("remove it, or choose a type with a generated sketch, such as arduino-rover",),
            )


@rule("BOARD012")
def sketch_limits(context: RuleContext) -> Iterator[Diagnostic]:
    """A baud rate or encoders that the generated sketch cannot handle."""
    for index, link, kind in context.native_lines:
        if kind.sketch is None or not kind.sketch.firmware:
            continue
        declared = link.own_baud
        dead_man = kind.sketch.firmware_timeout
        if trouble := wrong_baud(declared or kind.link.baud, dead_man):
            good = ", ".join(map(str, good_bauds(BAUDS, dead_man)))
            yield Diagnostic(
                "BOARD012",
                f"{trouble}: robot `{link.robot}` would not receive its commands",
                context.span("links", index, *(("baud",) if declared else ())),
                label="unsuitable for this board",
                help=(f"use one of {good}" if good else "raise `firmware_timeout`",),
            )
        yield from _too_many_pulses(context, link.robot, kind)


def _too_many_pulses(context: RuleContext, name: str, kind: RobotType) -> Iterator[Diagnostic]:
    """Reads each layer separately, since merging them for every robot is slow."""
    declared = [one.firmware.pulses_per_turn for one in reversed(context.document.settings_layers(name))]
    pulses = next((one for one in declared if one is not None), DEFAULTS.pulses_per_turn) or 0
    shape = kind.kinematics
    most = most_pulses(shape.wheel_speed_max, shape.wheel_radius or 1.0)
    if pulses > most:
        place = ("settings", "firmware", "pulses_per_turn") if declared[0] else ("type",)
        yield Diagnostic(
            "BOARD012",
            f"the board of robot `{name}` cannot count {pulses} pulses per turn "
            f"at {shape.wheel_speed_max:g} m/s",
            context.span("robots", name, *place),
            label=f"at most {most}",
            help=("use an encoder with fewer pulses, or set `wheel_speed_max` to the robot's real maximum",),
        )
