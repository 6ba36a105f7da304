"""A Bluetooth adapter serves no more robots than can be connected at once."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Fix, Note, Severity
from swarmctl.spec.edits import mend, set_key
from swarmctl.topology.radios import MOST, STABLE, RadioBudget, radio_budgets, spread


def crowded_adapters(case: Case) -> Iterator[Diagnostic]:
    """RADIO001, RADIO002: no more robots on one adapter than can be connected at once, and stay so."""
    budgets = _budgets(case)
    for budget in budgets:
        count = len(budget.members)
        if count <= STABLE:
            continue
        never = count > MOST
        moves = _moves(case, budgets, budget)
        yield Diagnostic(
            "RADIO001" if never else "RADIO002",
            f"adapter `{budget.adapter}` of host `{budget.host}` serves {count} robots; "
            + (f"a piconet has {MOST} active members" if never else f"about {STABLE} stay connected"),
            case.span("links", budget.links[MOST if never else STABLE], "robot"),
            severity=Severity.ERROR if never else Severity.WARNING,
            label=f"number {MOST + 1 if never else STABLE + 1} on it",
            notes=(
                Note(
                    case.span("hosts", budget.host, "bluetooth"),
                    f"it serves {', '.join(f'`{one}`' for one in budget.members)}",
                ),
            ),
            help=(_mend(case, budgets, budget, moves),),
            fix=_fix(case, budget, moves),
        )


def _budgets(case: Case) -> tuple[RadioBudget, ...]:
    return radio_budgets(case.spec, {index: one.load for index, one in case.line_budgets.items()})


def _moves(case: Case, budgets: tuple[RadioBudget, ...], crowded: RadioBudget) -> dict[str, str] | None:
    """The fewest moves between the host's adapters after which each is stable, or at least possible."""
    beside = [one for one in budgets if one.host == crowded.host]
    adapters = case.spec.hosts[crowded.host].bluetooth
    return spread(beside, adapters, STABLE) or (
        spread(beside, adapters, MOST) if len(crowded.members) > MOST else None
    )


def _mend(
    case: Case, budgets: tuple[RadioBudget, ...], crowded: RadioBudget, moves: dict[str, str] | None
) -> str:
    if moves:
        to: dict[str, list[str]] = {}
        for robot, adapter in moves.items():
            to.setdefault(adapter, []).append(f"`{robot}`")
        return "write " + "; ".join(f"`adapter: {one}` at {', '.join(robots)}" for one, robots in to.items())
    adapters = case.spec.hosts[crowded.host].bluetooth
    robots = sum(len(one.members) for one in budgets if one.host == crowded.host)
    missing = -(-robots // STABLE) - len(adapters)
    all_of = ", ".join([*adapters, *_new(adapters, missing)])
    more = f"{missing} more adapter{'s' if missing > 1 else ''}"
    return f"give `{crowded.host}` {more}, `bluetooth: [{all_of}]`, and each robot its `adapter`"


def _new(adapters: tuple[str, ...], count: int) -> list[str]:
    free = (name for number in range(100) if (name := f"hci{number}") not in adapters)
    return [next(free) for _ in range(count)]


def _fix(case: Case, crowded: RadioBudget, moves: dict[str, str] | None) -> Fix | None:
    if not moves:
        return None
    links = {link.robot: index for index, link in case.lines}
    source = case.document.source
    edits = [set_key(source, ("links", links[robot]), "adapter", adapter) for robot, adapter in moves.items()]
    return mend(f"spread the robots over the adapters of `{crowded.host}`", *edits)


RULES: tuple[Rule, ...] = (crowded_adapters,)
