"""The keys of `ros`: those that the middleware reads, the hosts they name, and what discovery reaches."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Fix, Note
from swarmctl.links.network_link import Wlan
from swarmctl.linter.context import RuleContext, rule
from swarmctl.plugins import MIDDLEWARES
from swarmctl.render.middleware import middleware_of
from swarmctl.yamltext.edits import make_fix, remove
from swarmctl.yamltext.source import Loc

_MANY = 10  # 3, 6, 12 nodes on three hosts sent 596, 2 224, 12 198 packets in 10 s; 12 with a server 4 584
_OTHERWISE = ("leave `discovery` out: nodes then know the addresses of all hosts",)


@rule("ROS001")
def unused_settings(context: RuleContext) -> Iterator[Diagnostic]:
    """Settings that the middleware does not read."""
    ros = context.spec.ros
    places: list[Loc] = [("ros", key) for key in type(ros).model_fields if key in ros.model_fields_set]
    hosts = context.spec.hosts.items()
    places += [("hosts", name, "master_port") for name, one in hosts if one.master_port is not None]
    for loc in places:
        key = str(loc[-1])
        if key not in {"distro", *_settings(context)}:
            others = [name for name in MIDDLEWARES if key in middleware_of(name).settings]
            named = " or ".join(f"`distro: {name}`" for name in others)
            yield Diagnostic(
                "ROS001",
                f"`{'` and `'.join(context.distros)}` does not use `{key}`",
                context.span(*loc, key=True),
                label="has no effect",
                notes=(Note(context.span("ros", "distro"), "the distribution"),)
                if "distro" in ros.model_fields_set
                else (),
                help=(f"remove it, or write {named}" if named else "remove it",),
                fix=make_fix(f"remove `{key}`", remove(context.source, loc), safe=not others),
            )


def _settings(context: RuleContext) -> frozenset[str]:
    return frozenset().union(*(one.settings for one in context.distros.values()))


@rule("ROS002")
def servers_outside(context: RuleContext) -> Iterator[Diagnostic]:
    """A host that is to run a discovery server, and runs no ROS."""
    if "servers" not in _settings(context):
        return
    for number, host in enumerate(context.spec.ros.servers):
        loc = ("ros", "servers", number)
        if host not in context.home:
            yield Diagnostic(
                "ROS002",
                f"`{host}` is to run a discovery server, and runs no ROS",
                context.span(*loc),
                label="belongs to no island",
                help=(f"name one of: {', '.join(f'`{one}`' for one in context.home)}",)
                if context.home
                else (),
                fix=make_fix(f"remove `{host}`", remove(context.source, loc), safe=False),
            )


@rule("ROS003", by_distro=True)
def undelivered_packages(context: RuleContext) -> Iterator[Diagnostic]:
    """Packages beside the spec that this distribution cannot build; not those that only others use."""
    if context.can("catkin"):
        return
    used, programs = {one.package for one in context.spec.programs.values()}, context.document.spec.programs
    for name in context.spec.packages:
        if name in used or name not in {one.package for one in programs.values()}:
            yield Diagnostic(
                "ROS003",
                f"package `{name}` is not delivered: swarmctl builds none of `{next(iter(context.distros))}`",
                context.span("packages", name, key=True),
                label="stays where it is",
                help=("build it in a workspace on its hosts, and name that as `ros.workspace`",),
            )


@rule("ROS004", needs="domains")
def servers_twice(context: RuleContext) -> Iterator[Diagnostic]:
    """A host that is listed twice among the servers."""
    servers = context.spec.ros.servers
    for number, host in enumerate(servers):
        if host in servers[:number]:
            loc = ("ros", "servers", number)
            yield Diagnostic(
                "ROS004",
                f"`{host}` is listed twice in `servers`; a host runs one",
                context.span(*loc),
                label="second entry",
                notes=(Note(context.span("ros", "servers", servers.index(host)), "first entry"),),
                help=("name another host, or remove it",),
                fix=make_fix("remove the second entry", remove(context.source, loc), safe=False),
            )


@rule("ROS005", needs="domains")
def discovery_within_hosts(context: RuleContext) -> Iterator[Diagnostic]:
    """A discovery that does not reach the other hosts of an island."""
    for island in context.islands:
        method, members = island.discovery.method, island.hosts
        if len(members) < 2:
            continue
        if method == "local":
            yield Diagnostic(
                "ROS005",
                f"nodes of the {len(members)} hosts of `{island.name}` do not find each other: "
                "discovery `local` stays on each host",
                context.span("ros", "discovery"),
                label="reaches no other host",
                help=_OTHERWISE,
                fix=_by_address(context),
            )
        if method != "multicast":
            continue
        for index, link in context.networks:
            joined = {host for host in members if context.topology.has_edge(host, index)}
            if link.multicast is False and len(joined) > 1:
                yield Diagnostic(
                    "ROS005",
                    f"nodes do not find each other over `{link.name}`, which passes no multicast",
                    context.span("ros", "discovery"),
                    label="by multicast",
                    notes=(Note(context.span("links", index, "multicast"), "the network"),),
                    help=_OTHERWISE,
                    fix=_by_address(context),
                )


def _by_address(context: RuleContext) -> Fix | None:
    """Returns the fix that removes `discovery`, so that nodes know the addresses of all hosts."""
    return make_fix("remove `discovery`", remove(context.source, ("ros", "discovery")), safe=False)


@rule("ROS006", needs="domains")
def multicast_storms(context: RuleContext) -> Iterator[Diagnostic]:
    """Discovery by multicast of many processes over one wlan."""
    for island in context.islands:
        if island.discovery.method != "multicast" or len(island.hosts) < 2:
            continue
        for index, link in context.networks:
            joined = {host for host in island.hosts if context.topology.has_edge(host, index)}
            count = sum(context.ros_processes[host] for host in joined)
            if isinstance(link, Wlan) and link.multicast is not False and len(joined) > 1 and count > _MANY:
                yield Diagnostic(
                    "ROS006",
                    f"{count} processes find each other by multicast over the wlan `{link.name}`; "
                    f"above {_MANY}, discovery alone may fill it",
                    context.span("ros", "discovery"),
                    label="packets grow with the square of the processes",
                    notes=(Note(context.span("links", index, "name"), "the wlan"),),
                    help=_OTHERWISE,
                )


@rule("ROS007", needs="domains")
def crowded_hosts(context: RuleContext) -> Iterator[Diagnostic]:
    """A host with more processes than the nodes of an island find."""
    for island in context.islands:
        most = context.middleware.most_processes(island)
        for host in island.hosts:
            count = context.ros_processes[host]
            if most is not None and count > most:
                yield Diagnostic(
                    "ROS007",
                    f"host `{host}` runs {count} processes with nodes, and {most} can be found there",
                    context.span("hosts", host, key=True),
                    label=f"{count - most} too many",
                    help=(
                        "move robots or programs to another host",
                        "or start several nodes in one process, by a launch file of your package",
                    ),
                )


@rule("ROS008", needs="domains")
def single_server(context: RuleContext) -> Iterator[Diagnostic]:
    """One discovery server, which some nodes outlive."""
    for island in context.islands:
        if island.discovery.method == "server" and len(island.discovery.servers) == 1:
            (server,) = island.discovery.servers
            key = "servers" if context.spec.ros.servers else "discovery"
            yield Diagnostic(
                "ROS008",
                f"nodes that start soon after a restart of the discovery server on `{server}` may never find "
                "those that were there before",
                context.span("ros", key),
                label="the only server",
                help=(*_OTHERWISE, "or name a second host in `servers`"),
            )
