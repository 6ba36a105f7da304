"""Checks the topics of a rosserial board against its limits."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.analysis.rosserial_load import PATIENCE, Carried, RosserialBudget, rosserial_budgets
from swarmctl.diagnostics import Diagnostic
from swarmctl.robot_types.board_limits import boards
from swarmctl.robot_types.message_sizes import size_of
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.rules.context import RuleContext, rule
from swarmctl.rules.families.serial_lines.rules import BAUDS, meant_baud, near_bauds
from swarmctl.suggest import did_you_mean
from swarmctl.yamltext.edits import make_fix, replace_value
from swarmctl.yamltext.source import Loc


@rule("BOARD001")
def known_boards(context: RuleContext) -> Iterator[Diagnostic]:
    """A board with unknown limits."""
    for loc, board in _named(context):
        if board not in boards():
            yield Diagnostic(
                "BOARD001",
                f"unknown board `{board}`",
                context.span(*loc, "board"),
                label="not in the list of boards",
                help=did_you_mean(board, boards(), "known boards"),
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
    for budget in rosserial_budgets(context):
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
