"""Bluetooth adapters and Crazyradios: how many robots one of them carries, and their channels."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

from swarmctl.analysis.radio_load import (
    MOST,
    STABLE,
    BluetoothBudget,
    bluetooth_budgets,
    dongle_budgets,
    dongle_links,
    spread,
)
from swarmctl.diagnostics import Diagnostic, Fix, Note
from swarmctl.links.radio_link import Radio
from swarmctl.linter.context import RuleContext, rule
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


_WIDE = 2_000_000  # bit/s at which a channel takes 2 MHz instead of 1 (nRF24LU1+ product specification)


@rule("RADIO003")
def crowded_dongles(context: RuleContext) -> Iterator[Diagnostic]:
    """More messages than one dongle can exchange."""
    for budget in dongle_budgets(context):
        if budget.share > 1:
            members = ", ".join(f"`{one}`" for one in budget.members)
            yield Diagnostic(
                "RADIO003",
                f"{budget.dongle} of host `{budget.host}` would need {budget.share:.2g} s for what it has to "
                "exchange in one",
                context.span("links", budget.links[-1], "robot"),
                label=f"{sum(budget.exchanges):.0f} exchanges a second with {members}",
                notes=(Note(context.span("hosts", budget.host, key=True), "the host of this dongle"),),
                help=(
                    "give the host another Crazyradio, on another channel, and its number to some links",
                    "or let the Crazyflies send less: the driver turns each kind of message off",
                ),
            )


@rule("RADIO005")
def shared_dongles(context: RuleContext) -> Iterator[Diagnostic]:
    """One dongle that several drivers open, each a process of its own; one finding per dongle."""
    for links in dongle_links(context).values():
        if len(links) < 2:
            continue
        (earlier, other), (index, link) = links[:2]
        yield Diagnostic(
            "RADIO005",
            f"the drivers of `{other.robot}` and `{link.robot}` both open {link.dongle} of `{link.host}`",
            context.span("links", index, "uri"),
            label="only one process can",
            notes=(Note(context.span("links", earlier, "uri"), f"the driver of `{other.robot}` opens it"),),
            help=(
                f"give `{link.robot}` a Crazyradio of its own: radio://1/...",
                "ignore this if one server opens the dongle for both",
            ),
        )


@rule("RADIO004")
def near_channels(context: RuleContext) -> Iterator[Diagnostic]:
    """Two dongles on one channel, or on channels that overlap; one finding for each pair of dongles."""
    for (first, ours), (second, theirs) in combinations(dongle_links(context).items(), 2):
        clash = next(((one, other) for one in ours for other in theirs if _overlap(one[1], other[1])), None)
        if clash is None:
            continue
        (index, one), (later, other) = clash
        same = one.channel == other.channel
        yield Diagnostic(
            "RADIO004",
            f"{first[1]} of `{first[0]}` and {second[1]} of `{second[0]}` "
            + (f"both send on channel {one.channel}" if same else "send on channels that overlap, ")
            + ("" if same else f"{one.channel} and {other.channel}"),
            context.span("links", later, "uri"),
            label="their packets collide",
            notes=(Note(context.span("links", index, "uri"), f"{first[1]} of `{first[0]}`"),),
            help=("give each dongle channels of its own; at 2M two channels apart",),
        )


def _overlap(one: Radio, other: Radio) -> bool:
    apart = 2 if _WIDE in (one.rate, other.rate) else 1
    return abs(one.channel - other.channel) < apart
