"""Memory of hosts and capacity of networks."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.analysis.host_load import SMALL_NODES, HostBudget
from swarmctl.analysis.network_load import CAREFUL_NETWORK, network_budgets
from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.linter.context import RuleContext, rule
from swarmctl.yamltext.edits import make_fix, replace_value

_FASTEST_WLAN = 10_000  # Mbit/s; two streams of IEEE 802.11be have 5 765, shared by both ways


@rule("CAP001")
def memory(context: RuleContext) -> Iterator[Diagnostic]:
    """A host whose processes need more memory than it has."""
    for budget in context.host_budgets:
        if budget.share > 1:
            yield Diagnostic(
                "CAP001",
                f"host `{budget.host}` needs {budget.needed_mb} MB, a {budget.computer} has "
                f"{budget.memory_mb} MB",
                context.span("hosts", budget.host, key=True),
                label=f"{budget.share:.0%} of its memory",
                notes=_largest(context, budget),
                help=(f"it runs {_parts(budget)}; move programs to another host",),
            )


def _parts(budget: HostBudget) -> str:
    return ", ".join(f"{size} MB for {what}" for what, size in budget.parts)


def _largest(context: RuleContext, budget: HostBudget) -> tuple[Note, ...]:
    """Where the memory of its largest program is declared."""
    programs = [(size, name) for name, size in budget.parts if name in context.spec.programs]
    if not programs:
        return ()
    size, name = max(programs)
    return (Note(context.span("programs", name, "memory_mb"), f"program `{name}` needs {size} MB"),)


@rule("CAP003")
def small_masters(context: RuleContext) -> Iterator[Diagnostic]:
    """A small board that runs the master of many nodes."""
    for budget in context.host_budgets:
        if budget.small and budget.served > SMALL_NODES:
            yield Diagnostic(
                "CAP003",
                f"host `{budget.host}`, a {budget.computer}, runs the master of {budget.served} nodes; "
                f"such a computer handles about {SMALL_NODES}",
                context.span("hosts", budget.host, key=True),
                label="slow to start and to reply",
                help=(_larger(context, budget.host),),
            )


def _larger(context: RuleContext, hub: str) -> str:
    """Returns the advice to use the island's host with the most memory, or a larger computer."""
    kinds = {name: context.computer_of(name) for name in context.spec.hosts}
    memory_of = {name: context.computers[kind].memory_mb for name, kind in kinds.items() if kind is not None}
    best = max(context.home[hub].hosts, key=lambda host: memory_of.get(host, 0))
    if memory_of.get(best, 0) > memory_of.get(hub, 0):
        return f"let `{best}`, a {kinds[best]}, run the master"
    return "run the master on a laptop or a newer board"


@rule("CAP004", "CAP005")
def networks(context: RuleContext) -> Iterator[Diagnostic]:
    """The declared topics exceed the capacity of a network, or almost do."""
    links = {link.name: index for index, link in context.networks}
    for budget in network_budgets(context):
        if budget.share > CAREFUL_NETWORK:
            never = budget.share > 1
            flows = sorted(budget.flows, key=lambda flow: -flow.bytes_per_second)[:3]
            largest = ", ".join(
                f"`{flow.topic}` {flow.bytes_per_second * 8 / 1e6:.3g} Mbit/s" for flow in flows
            )
            sources = {one.topic: one for one in context.endpoints if one.publishes}
            yield Diagnostic(
                "CAP004" if never else "CAP005",
                f"network `{budget.network}` has to carry {budget.needed_mbps:.3g} Mbit/s, its capacity is "
                f"{budget.capacity_mbps:g} Mbit/s",
                context.span("links", links[budget.network], "name"),
                label=f"{budget.share:.0%} of its capacity",
                notes=tuple(
                    Note(context.span(*sources[flow.topic].loc), f"from `{flow.origin}` to `{flow.to}`")
                    for flow in flows[:1]
                    if flow.topic in sources
                ),
                help=(
                    f"flows: {len(budget.flows)}; largest: {largest}",
                    "lower the rates, use smaller messages, or subscribe on the publisher's host",
                    "or measure the network with iperf3, and set `capacity_mbps`",
                ),
            )


@rule("CAP006")
def fast_wlans(context: RuleContext) -> Iterator[Diagnostic]:
    """A wlan with a capacity that no wlan has."""
    for index, link in context.networks:
        if link.wireless and link.capacity_mbps is not None and link.capacity_mbps > _FASTEST_WLAN:
            loc, meant = ("links", index, "capacity_mbps"), link.capacity_mbps / 1000
            yield Diagnostic(
                "CAP006",
                f"wlan `{link.name}` has a capacity of {link.capacity_mbps:g} Mbit/s",
                context.span(*loc),
                label="more than any wlan has",
                help=(f"if this is in kbit/s, write {meant:g}",),
                fix=make_fix(f"write {meant:g}", replace_value(context.source, loc, meant), safe=False),
            )
