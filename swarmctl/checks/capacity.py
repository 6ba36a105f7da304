"""Hosts bear what runs on them, networks what crosses them."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Note, Severity
from swarmctl.topology.capacity import (
    CAREFUL,
    CAREFUL_NETWORK,
    SMALL_NODES,
    HostBudget,
    network_budgets,
)


def memory(case: Case) -> Iterator[Diagnostic]:
    """CAP001, CAP002: what runs on a host fits into its memory, beside its system."""
    for budget in case.host_budgets:
        if budget.share > CAREFUL:
            never = budget.share > 1
            yield Diagnostic(
                "CAP001" if never else "CAP002",
                f"host `{budget.host}` needs {budget.needed_mb} MB, a {budget.computer} has "
                f"{budget.memory_mb} MB",
                case.span("hosts", budget.host, key=True),
                severity=Severity.ERROR if never else Severity.WARNING,
                label=f"{budget.share:.0%} of its memory",
                help=(f"it takes {_parts(budget)}; move some of it to another host",),
            )


def _parts(budget: HostBudget) -> str:
    return ", ".join(f"{size} MB for {what}" for what, size in budget.parts)


def small_masters(case: Case) -> Iterator[Diagnostic]:
    """CAP003: the master of many nodes runs on a computer that answers them in time."""
    for budget in case.host_budgets:
        if budget.small and budget.served > SMALL_NODES:
            yield Diagnostic(
                "CAP003",
                f"host `{budget.host}`, a {budget.computer}, runs the master of {budget.served} nodes; "
                f"{SMALL_NODES} are enough for such a computer",
                case.span("hosts", budget.host, key=True),
                severity=Severity.WARNING,
                label="slow to start, slow to answer",
                help=(_larger(case, budget.host),),
            )


def _larger(case: Case, hub: str) -> str:
    """Another host of the island with more memory, if there is one."""
    kinds = {
        name: host.computer or case.spec.defaults.host.computer for name, host in case.spec.hosts.items()
    }
    memory_of = {name: case.computers[kind].memory_mb for name, kind in kinds.items() if kind is not None}
    best = max(case.home[hub].hosts, key=lambda host: memory_of.get(host, 0))
    if memory_of.get(best, 0) > memory_of.get(hub, 0):
        return f"let `{best}`, a {kinds[best]}, run the master"
    return "let a laptop or a newer board run the master"


def networks(case: Case) -> Iterator[Diagnostic]:
    """CAP004, CAP005: what the spec says crosses a network fits into it."""
    links = {link.name: index for index, link in case.networks}
    for budget in network_budgets(case.spec, case.types, case.endpoints, case.islands):
        if budget.share > CAREFUL_NETWORK:
            never = budget.share > 1
            flows = budget.largest(3)
            largest = ", ".join(
                f"`{flow.topic}` {flow.bytes_per_second * 8 / 1e6:.3g} Mbit/s" for flow in flows
            )
            sources = {one.topic: one for one in case.endpoints if one.publishes}
            yield Diagnostic(
                "CAP004" if never else "CAP005",
                f"{budget.needed_mbps:.3g} Mbit/s are to cross `{budget.network}`, which carries "
                f"{budget.capacity_mbps:g} Mbit/s",
                case.span("links", links[budget.network], "name"),
                severity=Severity.ERROR if never else Severity.WARNING,
                label=f"{budget.share:.0%} of it",
                notes=tuple(
                    Note(case.span(*sources[flow.topic].loc), f"from `{flow.origin}` to `{flow.to}`")
                    for flow in flows[:1]
                    if flow.topic in sources
                ),
                help=(
                    (f"the most: {largest}; " if largest else f"{len(budget.flows)} topics share it; ")
                    + "lower the rates, send less, or hear it where it is made",
                    "or measure the network with iperf3, and say so: `capacity_mbps`",
                ),
            )


RULES: tuple[Rule, ...] = (memory, small_masters, networks)
