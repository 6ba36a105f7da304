"""Mode combined: every host is on one island, and every island's master runs on one of its hosts."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.rules.context import RuleContext, rule
from swarmctl.spec.model import Mode
from swarmctl.swarm.modes import ROLES, hub_of
from swarmctl.yamltext.edits import append_item, make_fix


@rule("MODE010")
def missing_islands(context: RuleContext) -> Iterator[Diagnostic]:
    """Mode combined without islands."""
    spec = context.spec
    if spec.mode is Mode.COMBINED and not spec.islands:
        yield Diagnostic(
            "MODE010",
            "mode `combined` needs `islands`",
            context.span("mode"),
            label="no islands",
            help=(
                "add them: islands: {west: {mode: central, hub: ..., hosts: [...]}, east: {...}}",
                "if each host runs its own master, write `mode: standalone`",
            ),
        )


@rule("MODE011", "MODE012")
def island_membership(context: RuleContext) -> Iterator[Diagnostic]:
    """A host on no island, or on several."""
    spec = context.spec
    if spec.mode is not Mode.COMBINED or not spec.islands:
        return
    first: dict[str, tuple[str, int]] = {}
    for name, island in spec.islands.items():
        for place, host in enumerate(island.hosts):
            if host not in first:
                first[host] = (name, place)
                continue
            other, earlier = first[host]
            same = other == name
            yield Diagnostic(
                "MODE012",
                f"host `{host}` is listed twice on island `{name}`"
                if same
                else f"host `{host}` is on two islands, `{other}` and `{name}`",
                context.span("islands", name, "hosts", place),
                label="second entry" if same else "a host follows one master",
                notes=(Note(context.span("islands", other, "hosts", earlier), "first entry"),),
                help=("keep one of the two; topics that the other island needs are bridged",),
            )
    ways = {host.via for host in spec.hosts.values()} - _working(
        context
    )  # to jump through is no work for ROS
    hubs = {hub_of(island) for island in spec.islands.values()}  # MODE013 reports these
    for host in spec.hosts:
        if host not in first and host not in ways and host not in hubs:
            yield Diagnostic(
                "MODE011",
                f"host `{host}` is on no island",
                context.span("hosts", host, key=True),
                label="follows no master",
                help=("add it to the `hosts` of an island",),
            )


def _working(context: RuleContext) -> set[str]:
    """Returns the hosts that drive a robot, run a program or command."""
    spec = context.spec
    found = {*context.driving.values(), *context.program_hosts.values()}
    found |= {context.commander_host(one.by) for one in spec.control}
    return {host for host in found if host is not None}


@rule("MODE013")
def hubs_on_their_islands(context: RuleContext) -> Iterator[Diagnostic]:
    """An island whose master would run on a host of another island."""
    spec = context.spec
    if spec.mode is not Mode.COMBINED:
        return
    for name, island in spec.islands.items():
        hub = hub_of(island)
        if hub is not None and hub not in island.hosts:
            key = ROLES[Mode(island.mode)].key
            yield Diagnostic(
                "MODE013",
                f"the {key} `{hub}` of island `{name}` is not one of its hosts",
                context.span("islands", name, key),
                label="not in its `hosts`",
                notes=(Note(context.span("islands", name, "hosts"), "its hosts"),),
                help=(f"add `{hub}` to the hosts of `{name}`, or choose one of them",),
                fix=None
                if any(hub in other.hosts for other in spec.islands.values())
                else make_fix(
                    f"add `{hub}` to the hosts of `{name}`",
                    append_item(context.source, ("islands", name, "hosts"), hub),
                    safe=False,
                ),
            )
