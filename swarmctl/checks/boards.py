"""What a microcontroller board is to publish and to hear fits into it, before anybody flashes it."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.checks.lines import BAUDS, nearest_baud
from swarmctl.spec.boards import boards
from swarmctl.spec.diagnostics import Diagnostic, Severity
from swarmctl.spec.edits import mend, replace_value
from swarmctl.spec.messages import known_types, size_of
from swarmctl.spec.source import Loc
from swarmctl.spec.suggest import did_you_mean
from swarmctl.topology.boards import CAREFUL, PATIENCE, BoardBudget, Carried, board_budgets


def known_boards(case: Case) -> Iterator[Diagnostic]:
    """BOARD001: a board whose limits are known."""
    for loc, board in _named(case):
        if board not in boards():
            yield Diagnostic(
                "BOARD001",
                f"there is no board called `{board}`",
                case.span(*loc, "board"),
                label="not known",
                help=did_you_mean(board, boards(), "known boards"),
            )


def _named(case: Case) -> Iterator[tuple[Loc, str]]:
    """The boards of programs and of the spec's own robot types, by where they are named."""
    for name, program in case.spec.programs.items():
        if program.board is not None:
            yield ("programs", name), program.board
    for name, kind in case.spec.types.items():
        if kind.sketch is not None:
            yield ("types", name, "protocol"), kind.sketch.board


def _budgets(case: Case) -> Iterator[BoardBudget]:
    """One for each sketch: robots of a type whose lines are equally fast have the same."""
    alike: set[tuple[str, int]] = set()
    for budget in board_budgets(case.spec, case.types):
        if budget.kind == "robot":
            sketch = (case.spec.robots[budget.owner].type, budget.baud)
            if sketch in alike:
                continue
            alike.add(sketch)
        yield budget


def places(case: Case) -> Iterator[Diagnostic]:
    """BOARD002: no more publishers and subscribers than the client library has places for."""
    for budget in _budgets(case):
        counts = (
            ("publishes", budget.published, budget.board.publishers),
            ("subscribes", budget.subscribed, budget.board.subscribers),
        )
        for key, count, most in counts:
            if count > most:
                yield Diagnostic(
                    "BOARD002",
                    f"{budget.kind} `{budget.owner}` {key} {count} topics; "
                    f"its {budget.name} has {most} places",
                    case.span(*budget.loc, key, most),
                    label="the first without a place",
                    help=("put several values into one topic, or use a larger board",),
                )


def buffers(case: Case) -> Iterator[Diagnostic]:
    """BOARD003, BOARD004: every message fits into the board's buffer, and it is known that it does."""
    for budget in _budgets(case):
        for one in budget.topics:
            room = budget.room(one)
            if one.bytes is None:
                yield _unknown(case, budget, one)
            elif one.bytes > room:
                verb = "sends" if one.sent else "receives"
                yield Diagnostic(
                    "BOARD003",
                    f"a {one.topic.type} of {one.bytes} bytes cannot pass: the {budget.name} of "
                    f"`{budget.owner}` {verb} {room} bytes at most",
                    case.span(*budget.loc, one.key, one.index),
                    label=f"{one.bytes - room} bytes too many",
                    help=(_smaller(one),),
                )


def _smaller(one: Carried) -> str:
    if one.topic.type == "nav_msgs/Odometry":
        return "let the board publish wheel ticks (std_msgs/Int32), and a program on the host the odometry"
    return "use a smaller type (no covariance, no header), split it, or use a board with larger buffers"


def _unknown(case: Case, budget: BoardBudget, one: Carried) -> Diagnostic:
    known = size_of(one.topic.type)
    room = budget.room(one)
    what = (
        f"`{one.topic.type}` is not a type whose size is known"
        if known is None
        else f"how large a {one.topic.type} is depends on what is in it ({known.bytes} bytes when empty)"
    )
    package = one.topic.type.partition("/")[0] + "/"
    beside = [name for name in known_types() if name.startswith(package)]
    near = did_you_mean(one.topic.type, beside, f"types of {package[:-1]}") if known is None else ()
    return Diagnostic(
        "BOARD004",
        f"{what}; the {budget.name} of `{budget.owner}` lets {room} bytes pass",
        case.span(*budget.loc, one.key, one.index, "type"),
        severity=Severity.WARNING,
        label="will it fit?",
        help=(*near, "say how large it gets: `size:` in bytes, beside its type"),
    )


def board_lines(case: Case) -> Iterator[Diagnostic]:
    """BOARD005, BOARD006: the declared rates leave room on the board's serial line."""
    for budget in _budgets(case):
        if budget.share > CAREFUL:
            never = budget.share > 1
            yield Diagnostic(
                "BOARD005" if never else "BOARD006",
                f"the topics of `{budget.owner}` need {budget.needed:.0f} B/s one way, its line carries "
                f"{budget.available:.0f} B/s: {budget.share:.0%}",
                case.span(*budget.loc, "board"),
                severity=Severity.ERROR if never else Severity.WARNING,
                label=f"at {budget.baud} baud",
                help=(
                    f"lower the rates, send smaller messages, or raise {_baud(budget, '...')} at both ends",
                ),
            )


def _baud(budget: BoardBudget, value: object) -> str:
    """The setting of the line's speed, as people write it."""
    return f"`params: {{baud: {value}}}`" if budget.kind == "program" else f"`baud: {value}` of its link"


def slow_frames(case: Case) -> Iterator[Diagnostic]:
    """BOARD007: a message to the board is there before the board gives up on it."""
    for budget in _budgets(case):
        for one in budget.topics:
            if one.sent or one.bytes is None or one.bytes > budget.room(one):
                continue
            seconds = budget.seconds(one)
            if seconds > budget.patience:
                faster = next((baud for baud in BAUDS if seconds * budget.baud / baud < PATIENCE), BAUDS[-1])
                yield Diagnostic(
                    "BOARD007",
                    f"a {one.topic.type} takes {seconds * 1000:.0f} ms to `{budget.owner}`'s board, which "
                    f"drops a frame that is not there after {budget.patience * 1000:.0f} ms",
                    case.span(*budget.loc, one.key, one.index),
                    label=f"{one.bytes} bytes at {budget.baud} baud",
                    help=(f"{_baud(budget, faster)} here and in the sketch, or a smaller type",),
                )


def announcements(case: Case) -> Iterator[Diagnostic]:
    """BOARD008: the board can say what its topics are called."""
    for budget in _budgets(case):
        for one in budget.topics:
            if one.announcement > budget.board.sends:
                yield Diagnostic(
                    "BOARD008",
                    f"the {budget.name} of `{budget.owner}` cannot announce `{one.topic.topic}`: "
                    f"that takes {one.announcement} of {budget.board.sends} bytes",
                    case.span(*budget.loc, one.key, one.index, "topic"),
                    label="name and type are too long",
                    help=(
                        "give it a shorter name"
                        + (", and `remap` it here" if budget.kind == "program" else ""),
                    ),
                )


def odd_board_bauds(case: Case) -> Iterator[Diagnostic]:
    """BOARD009: the speed of a board's line is one that both ends know."""
    for name, program in case.spec.programs.items():
        baud = program.params.get("baud")
        if program.board is None or baud is None or (isinstance(baud, int) and baud in BAUDS):
            continue
        near = nearest_baud(baud) if isinstance(baud, int) and baud > 0 else BAUDS[9]
        place = ("programs", name, "params", "baud")
        yield Diagnostic(
            "BOARD009",
            f"`{baud}` is no speed of a serial line; the sketch of `{name}` would never be heard",
            case.span(*place),
            label="bits per second",
            help=(f"did you mean {near}?",),
            fix=mend(f"write {near}", replace_value(case.document.source, place, near)),
        )


RULES: tuple[Rule, ...] = (
    known_boards,
    places,
    buffers,
    board_lines,
    slow_frames,
    announcements,
    odd_board_bauds,
)
