"""Masters between which topics are bridged: on a common network, in each other's peer lists and filters."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.rules.context import RuleContext, rule
from swarmctl.rules.families.multimaster.discovery import discovering, multicast
from swarmctl.spec.multimaster_model import Multimaster
from swarmctl.yamltext.edits import append_item, make_fix


@rule("MM007", "MM008")
def parted_islands(context: RuleContext) -> Iterator[Diagnostic]:
    """A topic bridged between masters without a common network, or without discovery."""
    found = discovering(context)
    hubs = {island.name: island.hub for island in context.islands}
    seen: set[frozenset[str]] = set()
    for bridge in context.bridges:
        for to in bridge.to:
            one, other = hubs[bridge.origin], hubs[to]
            if frozenset((one, other)) in seen:
                continue
            seen.add(frozenset((one, other)))
            if not any(other in context.members[index] for index, _ in context.networks_of[one]):
                yield Diagnostic(
                    "MM007",
                    f"`{bridge.topic}` is bridged from `{one}` to `{other}`, which share no network",
                    context.span("hosts", other, key=True),
                    label="no wlan or ethernet has both hosts",
                    notes=(Note(context.span("hosts", one, key=True), "the origin"),),
                    help=(f"put both on one network: {{kind: wlan, name: ..., hosts: [{one}, {other}]}}",),
                )
            elif found is not None and _undiscovered(context, found[0], one, other):
                loc = ("multimaster", "robot_hosts", one)
                yield Diagnostic(
                    "MM008",
                    f"`{one}` and `{other}` cannot find each other: no multicast, and neither is a peer",
                    context.span(*loc, key=True),
                    label=f"`{bridge.topic}` is bridged between them",
                    notes=(
                        Note(
                            context.span("multimaster", "robot_hosts", other, key=True), "the other peer list"
                        ),
                    ),
                    help=("add each to the list of the other, or remove `robot_hosts` to make all peers",),
                    fix=make_fix(
                        "add each to the peers of the other",
                        append_item(context.source, loc, other),
                        append_item(context.source, ("multimaster", "robot_hosts", other), one),
                        safe=False,
                    ),
                )


def _undiscovered(context: RuleContext, settings: Multimaster, one: str, other: str) -> bool:
    lists = settings.robot_hosts
    return (
        other not in lists.get(one, (other,))
        and one not in lists.get(other, (one,))
        and multicast(context, one, other) is False
    )


@rule("MM014")
def excluded_origins(context: RuleContext) -> Iterator[Diagnostic]:
    """A bridged topic from a master that the filters exclude."""
    found = discovering(context)
    if found is None or not (found[0].sync_hosts or found[0].ignore_hosts):
        return
    settings, _ = found
    hubs = {island.name: island.hub for island in context.islands}
    reported: set[str] = set()
    for bridge in context.bridges:
        hub = hubs[bridge.origin]
        out = hub in settings.ignore_hosts or (settings.sync_hosts and hub not in settings.sync_hosts)
        if not out or hub in reported:
            continue
        reported.add(hub)
        ignored = hub in settings.ignore_hosts
        key = "ignore_hosts" if ignored else "sync_hosts"
        yield Diagnostic(
            "MM014",
            f"`{bridge.topic}` is bridged from `{hub}`, which the filters exclude",
            context.span("multimaster", key, settings.ignore_hosts.index(hub))
            if ignored
            else context.span("multimaster", key),
            label="excluded here" if ignored else f"without `{hub}`",
            help=(f"remove `{hub}` from the list" if ignored else f"add `{hub}` to `sync_hosts`",),
            fix=None
            if ignored
            else make_fix(
                f"add `{hub}`", append_item(context.source, ("multimaster", "sync_hosts"), hub), safe=False
            ),
        )
