"""Robots with an address of their own: reachable from their host, and quick enough to be commanded."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.analysis.ip_link_load import ip_link_budgets
from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.rules.context import RuleContext, rule
from swarmctl.swarm.addresses import ip_of, means_self, normal

_CAREFUL = 0.7  # share of a wireless link above which packets wait for each other


@rule("LINK009")
def addresses_of_hosts(context: RuleContext) -> Iterator[Diagnostic]:
    """The address of a robot is that of a host."""
    hosts = {normal(host.address): name for name, host in context.spec.hosts.items()}
    hosts |= {name: name for name in context.spec.hosts}
    for index, ends in context.ip_links.items():
        link = ends.link
        owner = link.host if means_self(link.address) else hosts.get(normal(link.address))
        if owner is not None:
            yield Diagnostic(
                "LINK009",
                f"the address of robot `{link.robot}` is that of host `{owner}`",
                context.span("links", index, "address"),
                label=f"reaches `{owner}` itself",
                notes=(Note(context.span("hosts", owner, key=True), "this host"),),
                help=(
                    "write the address that the robot's own network interface has",
                    f"suppress this if `{owner}` is the robot's computer, or simulates it",
                ),
            )


@rule("LINK010")
def addresses_elsewhere(context: RuleContext) -> Iterator[Diagnostic]:
    """The address of a robot lies in no network of its host."""
    for index, ends in context.ip_links.items():
        link = ends.link
        own = [(network, context.subnets[at]) for at, network in context.networks_of.get(link.host, ())]
        if ends.network is not None or ip_of(link.address) is None or means_self(link.address):
            continue
        if not own or any(subnet is None for _, subnet in own):
            continue
        known = ", ".join(f"`{network.name}` {inside}" for network, inside in own)
        subnet = f"{link.address.rpartition('.')[0]}.0/24"
        access_point = f"{{kind: wlan, name: {link.robot}-ap, hosts: [{link.host}], subnet: {subnet}}}"
        yield Diagnostic(
            "LINK010",
            f"robot `{link.robot}` at {link.address} lies in no network of host `{link.host}`",
            context.span("links", index, "address"),
            label="no network leads there",
            notes=(Note(context.span("hosts", link.host, key=True), f"its networks: {known}"),),
            help=(
                "correct the address",
                f"or add the network, for example its own access point: {access_point}",
            ),
        )


@rule("LINK011")
def slow_links(context: RuleContext) -> Iterator[Diagnostic]:
    """A link whose latency is as long as the time after which a robot without commands stops."""
    for index, ends in context.ip_links.items():
        link = ends.link
        timeout = context.command_timeouts[link.robot]
        if link.latency is None or link.robot not in context.command_topics or link.latency < timeout:
            continue
        yield Diagnostic(
            "LINK011",
            f"the link of robot `{link.robot}` takes {link.latency:g} s there and back, its dead-man "
            f"{timeout:g} s",
            context.span("links", index, "latency"),
            label="the stop itself arrives that late",
            notes=(Note(context.span("robots", link.robot, key=True), f"robot `{link.robot}`"),),
            help=("use a faster network, such as an access point for the robots alone", "or drive slowly"),
        )


@rule("LINK012")
def full_links(context: RuleContext) -> Iterator[Diagnostic]:
    """A link that is to carry more than its capacity."""
    for budget in ip_link_budgets(context):
        if budget.share is None or budget.share <= _CAREFUL:
            continue
        yield Diagnostic(
            "LINK012",
            f"the link of robot `{budget.robot}` carries {budget.needed_mbps:.3g} of "
            f"{budget.capacity_mbps:g} Mbit/s",
            context.span("links", budget.link, "capacity_mbps"),
            label=f"{budget.share:.0%} of its capacity",
            notes=(Note(context.span("robots", budget.robot, key=True), f"robot `{budget.robot}`"),),
            help=(
                "let the driver publish less, or use a faster network",
                "`load_mbps` of the type's link has what the robot really sends, where it was measured",
            ),
        )
