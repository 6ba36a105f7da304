"""The number of robots on one Bluetooth adapter."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from swarmctl.analysis.bluetooth_load import MOST, STABLE, BluetoothBudget, bluetooth_budgets, spread
from swarmctl.diagnostics import Diagnostic, Fix, Note
from swarmctl.rules.context import RuleContext, rule
from swarmctl.yamltext.edits import make_fix, set_key

_MOST_DONGLES = 6  # more USB adapters on one host are not suggested

Moves = Mapping[str, str]  # new adapter by robot


@rule("RADIO001", "RADIO002")
def crowded_adapters(context: RuleContext) -> Iterator[Diagnostic]:
    """More robots on one adapter than can connect, or than stay connected."""
    loads = {index: one.load for index, one in context.line_budgets.items()}
    hosts: dict[str, list[BluetoothBudget]] = {}
    for budget in bluetooth_budgets(context, loads):
        hosts.setdefault(budget.host, []).append(budget)
    for host, budgets in hosts.items():
        crowded = [one for one in budgets if len(one.members) > STABLE]
        if crowded:
            moves = _moves(budgets, context.spec.hosts[host].bluetooth)
            help_ = _advice(moves) if moves else _more_adapters(context, host, budgets)
            fix = _fix(context, host, budgets, moves)
            for number, budget in enumerate(crowded):  # one fix corrects all adapters of a host
                yield _crowded(context, budget, help_, None if number else fix)


def _crowded(context: RuleContext, budget: BluetoothBudget, help_: str, fix: Fix | None) -> Diagnostic:
    count = len(budget.members)
    never = count > MOST
    bound = MOST if never else STABLE
    members = ", ".join(f"`{one}`" for one in budget.members)
    return Diagnostic(
        "RADIO001" if never else "RADIO002",
        f"adapter `{budget.adapter}` of host `{budget.host}` serves {count} robots; "
        + (f"a piconet has {MOST} active members" if never else f"about {STABLE} stay connected"),
        context.span("links", budget.links[bound], "robot"),
        label=f"robot {bound + 1} on this adapter",
        notes=(Note(context.span("hosts", budget.host, "bluetooth"), f"its robots: {members}"),),
        help=(help_,),
        fix=fix,
    )


def _moves(budgets: Sequence[BluetoothBudget], adapters: Sequence[str]) -> Moves | None:
    """Returns the fewest moves that make all adapters of a host stable, or at least usable."""
    stable = spread(budgets, adapters, STABLE)
    if stable or max(len(one.members) for one in budgets) <= MOST:
        return stable
    return spread(budgets, adapters, MOST)


def _advice(moves: Moves) -> str:
    to: dict[str, list[str]] = {}
    for robot, adapter in moves.items():
        to.setdefault(adapter, []).append(f"`{robot}`")
    return "set " + "; ".join(f"`adapter: {one}` for {', '.join(robots)}" for one, robots in to.items())


def _more_adapters(context: RuleContext, host: str, budgets: Sequence[BluetoothBudget]) -> str:
    adapters = context.spec.hosts[host].bluetooth
    missing = -(-sum(len(one.members) for one in budgets) // STABLE) - len(adapters)
    if missing > _MOST_DONGLES:
        return f"`{host}` would need {missing} more adapters; move some of its robots to other hosts"
    free = [f"hci{number}" for number in range(100) if f"hci{number}" not in adapters]
    all_of = ", ".join([*adapters, *free[:missing]])
    more = f"{missing} more adapter{'s' if missing > 1 else ''}"
    return f"add {more} to `{host}`, `bluetooth: [{all_of}]`, and set the `adapter` of each link"


def _fix(
    context: RuleContext, host: str, budgets: Sequence[BluetoothBudget], moves: Moves | None
) -> Fix | None:
    if not moves:
        return None
    links = {robot: link for one in budgets for robot, link in zip(one.members, one.links, strict=True)}
    source = context.document.source
    edits = [set_key(source, ("links", links[robot]), "adapter", to) for robot, to in moves.items()]
    return make_fix(f"distribute the robots over the adapters of `{host}`", *edits, safe=False)
