"""A Bluetooth adapter serves no more robots than can be connected at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Fix, Note, Severity
from swarmctl.spec.edits import mend, set_key
from swarmctl.topology.radios import MOST, STABLE, RadioBudget, radio_budgets, spread

_MOST_DONGLES = 6  # that anybody would plug into one host

Moves = Mapping[str, str]  # which robot goes to which adapter


def crowded_adapters(case: Case) -> Iterator[Diagnostic]:
    """RADIO001, RADIO002: no more robots on one adapter than can be connected at once, and stay so."""
    loads = {index: one.load for index, one in case.line_budgets.items()}
    hosts: dict[str, list[RadioBudget]] = {}
    for budget in radio_budgets(case.spec, loads):
        hosts.setdefault(budget.host, []).append(budget)
    for host, budgets in hosts.items():
        crowded = [one for one in budgets if len(one.members) > STABLE]
        if crowded:
            moves = _moves(budgets, case.spec.hosts[host].bluetooth)
            help_ = _told(moves) if moves else _more_adapters(case, host, budgets)
            fix = _fix(case, host, budgets, moves)
            for number, budget in enumerate(crowded):  # one fix mends all adapters of a host
                yield _crowded(case, budget, help_, None if number else fix)


def _crowded(case: Case, budget: RadioBudget, help_: str, fix: Fix | None) -> Diagnostic:
    count = len(budget.members)
    never = count > MOST
    bound = MOST if never else STABLE
    members = ", ".join(f"`{one}`" for one in budget.members)
    return Diagnostic(
        "RADIO001" if never else "RADIO002",
        f"adapter `{budget.adapter}` of host `{budget.host}` serves {count} robots; "
        + (f"a piconet has {MOST} active members" if never else f"about {STABLE} stay connected"),
        case.span("links", budget.links[bound], "robot"),
        severity=Severity.ERROR if never else Severity.WARNING,
        label=f"number {bound + 1} on it",
        notes=(Note(case.span("hosts", budget.host, "bluetooth"), f"it serves {members}"),),
        help=(help_,),
        fix=fix,
    )


def _moves(budgets: Sequence[RadioBudget], adapters: Sequence[str]) -> Moves | None:
    """The fewest moves after which all adapters of a host are stable; else, after which they can work."""
    stable = spread(budgets, adapters, STABLE)
    if stable or max(len(one.members) for one in budgets) <= MOST:
        return stable
    return spread(budgets, adapters, MOST)


def _told(moves: Moves) -> str:
    to: dict[str, list[str]] = {}
    for robot, adapter in moves.items():
        to.setdefault(adapter, []).append(f"`{robot}`")
    return "write " + "; ".join(f"`adapter: {one}` at {', '.join(robots)}" for one, robots in to.items())


def _more_adapters(case: Case, host: str, budgets: Sequence[RadioBudget]) -> str:
    adapters = case.spec.hosts[host].bluetooth
    missing = -(-sum(len(one.members) for one in budgets) // STABLE) - len(adapters)
    if missing > _MOST_DONGLES:
        return f"`{host}` would need {missing} more adapters; let other hosts drive some of its robots"
    free = [f"hci{number}" for number in range(100) if f"hci{number}" not in adapters]
    all_of = ", ".join([*adapters, *free[:missing]])
    more = f"{missing} more adapter{'s' if missing > 1 else ''}"
    return f"give `{host}` {more}, `bluetooth: [{all_of}]`, and each robot its `adapter`"


def _fix(case: Case, host: str, budgets: Sequence[RadioBudget], moves: Moves | None) -> Fix | None:
    if not moves:
        return None
    links = {robot: link for one in budgets for robot, link in zip(one.members, one.links, strict=True)}
    source = case.document.source
    edits = [set_key(source, ("links", links[robot]), "adapter", to) for robot, to in moves.items()]
    return mend(f"spread the robots over the adapters of `{host}`", *edits)


RULES: tuple[Rule, ...] = (crowded_adapters,)
