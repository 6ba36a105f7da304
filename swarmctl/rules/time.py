"""Time synchronisation and simulated time: hosts follow one clock, and nodes read one clock."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Note, Span
from swarmctl.linter.context import RuleContext, rule
from swarmctl.rules.topics import bridged
from swarmctl.swarm.addresses import means_self, normal
from swarmctl.swarm.clocks import time_root
from swarmctl.swarm.topics import CLOCK
from swarmctl.yamltext import edits


@rule("TIME001")
def followers(context: RuleContext) -> Iterator[Diagnostic]:
    """A host that shares no network with the time root. NET001 reports hosts without their hub."""
    named, root = context.spec.time.root, time_root(context.spec, context.islands)
    if root is None or root not in context.home:
        return
    place = ("time", "root") if named is not None else ("hosts", root)
    for name in context.home:
        if not context.meet(name, root) and (named or context.reaches(name, root)):
            yield Diagnostic(
                "TIME001",
                f"host `{name}` cannot synchronise its clock with `{root}`",
                context.span("hosts", name, key=True),
                label="no wlan or ethernet has both hosts",
                notes=(Note(context.span(*place, key=named is None), "the time root"),),
                help=(f"put `{name}` and `{root}` on one network, or choose another root",),
            )


@rule("TIME002")
def roots_without_clock(context: RuleContext) -> Iterator[Diagnostic]:
    """A time root without a battery-backed clock and without a time server."""
    root = time_root(context.spec, context.islands)
    if (
        root is None
        or len(context.home) < 2
        or context.spec.time.servers
        or _keeps_time(context, root) is not False
    ):
        return
    place = ("time", "root") if context.spec.time.root is not None else ("hosts", root)
    named = next((name for name in context.home if _keeps_time(context, name)), None)
    yield Diagnostic(
        "TIME002",
        f"the time root `{root}` has no battery-backed clock and no time server",
        context.span(*place, key=context.spec.time.root is None),
        label=f"a {context.computer_of(root)} boots with a wrong time",
        help=(
            *((f"choose a root with a battery-backed clock: time: {{root: {named}}}",) if named else ()),
            "or set a server that it can reach: time: {servers: [pool.ntp.org]}",
        ),
    )


@rule("TIME003")
def missing_roots(context: RuleContext) -> Iterator[Diagnostic]:
    """Several masters, hosts without a battery-backed clock, and no time root."""
    if len(context.islands) < 2 or context.spec.time.root is not None:
        return
    lost = next((name for name in context.home if _keeps_time(context, name) is False), None)
    if lost is None:
        return
    hubs = [island.hub for island in context.islands]
    named = next((hub for hub in hubs if _keeps_time(context, hub)), hubs[0])
    several = "masters" if context.has_masters else "islands"
    yield Diagnostic(
        "TIME003",
        f"{len(hubs)} {several} without `time.root`, and host `{lost}` has no battery-backed clock",
        context.span("hosts", lost, key=True),
        label=f"a {context.computer_of(lost)} boots with a wrong time",
        help=(f"add `time: {{root: {named}}}`, so that all hosts follow its clock",),
        fix=edits.make_fix(f"set the time root to `{named}`", _with_root(context, named), safe=False),
    )


@rule("TIME004", "TIME005")
def unsuitable_roots(context: RuleContext) -> Iterator[Diagnostic]:
    """A time root that runs no ROS, or that is optional."""
    root = context.spec.time.root
    if root is None:
        return
    if root not in context.home:
        yield Diagnostic(
            "TIME004",
            f"the time root `{root}` runs no ROS, so swarmctl does not configure it",
            context.span("time", "root"),
            label="the time root",
            notes=(Note(context.span("hosts", root, key=True), "runs no ROS"),),
            help=(
                f"choose a host that runs ROS: {', '.join(f'`{name}`' for name in list(context.home)[:5])}",
            ),
        )
    elif context.spec.hosts[root].optional:
        yield Diagnostic(
            "TIME005",
            f"the time root `{root}` is optional; without it, clocks drift apart",
            context.span("time", "root"),
            label="the time root",
            notes=(Note(context.span("hosts", root, "optional"), "optional"),),
            help=("choose a host that is always present",),
        )


@rule("TIME006")
def servers_in_the_swarm(context: RuleContext) -> Iterator[Diagnostic]:
    """A time server of the root that follows the root."""
    if not context.spec.time.servers:
        return
    root = time_root(context.spec, context.islands)
    hosts = {normal(host.address): name for name, host in context.spec.hosts.items()}
    for place, server in enumerate(context.spec.time.servers):
        name = root if means_self(server) else hosts.get(normal(server))
        if name is None:
            continue
        who = f"the time root `{name}` itself" if name == root else f"host `{name}`, which follows the root"
        yield Diagnostic(
            "TIME006",
            f"the time root cannot follow `{server}`: that is {who}",
            context.span("time", "servers", place),
            label="a synchronisation loop",
            help=("choose a server outside the swarm",),
        )


def _with_root(context: RuleContext, host: str) -> edits.Edits:
    source = context.document.source
    if "time" in context.spec.model_fields_set:
        return edits.set_key(source, ("time",), "root", host)
    return edits.set_key(source, (), "time", {"root": host})


def _keeps_time(context: RuleContext, host: str) -> bool | None:
    """Returns whether a host has a battery-backed clock, or None if its computer is unknown."""
    computer = context.computer_of(host)
    return context.computers[computer].clock if computer is not None else None


_PARAMETER = "/use_sim_time"
_PUBLISHES = f"publishes: [{{topic: {CLOCK}, type: rosgraph_msgs/Clock}}]"


@rule("TIME007", needs="ros1-nodes")
def clocks(context: RuleContext) -> Iterator[Diagnostic]:
    """Nodes use simulated time on an island that has no clock, or two."""
    if not context.spec.ros.use_sim_time:
        return
    by_island: dict[str, list[tuple[str, Span]]] = {}
    reached = bridged(context).get(CLOCK, set())
    for owner, host, span in _publishers(context):
        home = context.home.get(host or "")
        if home is not None:
            for name in reached | {home.name} if home.name in reached else {home.name}:
                by_island.setdefault(name, []).append((owner, span))
    for island in context.islands:
        found = by_island.get(island.name, [])
        if not found:
            where = f" on island `{island.name}`" if len(context.islands) > 1 else ""
            yield Diagnostic(
                "TIME007",
                f"nothing{where} publishes `{CLOCK}`, the time of all nodes there",
                context.span("ros", "use_sim_time"),
                label="without a clock the time stands at 0",
                help=(f"declare it at the simulator or player of that island: {_PUBLISHES}",),
            )
        for owner, span in found[1:]:
            first, place = found[0]
            yield Diagnostic(
                "TIME007",
                f"{first} and {owner} both publish `{CLOCK}`",
                span,
                label="the time jumps between two clocks",
                notes=(Note(place, "the other clock"),),
                help=("keep one clock for each island",),
            )


@rule("TIME008", needs="ros1-nodes")
def unread_clocks(context: RuleContext) -> Iterator[Diagnostic]:
    """A clock that no node reads, or a launch file that makes nodes read one halfway through a start."""
    if context.spec.ros.use_sim_time:
        return
    for owner, _, span in _publishers(context):
        yield Diagnostic(
            "TIME008",
            f"{owner} publishes `{CLOCK}`, which no node reads without `use_sim_time`",
            span,
            label="nodes use the time of their hosts",
            help=("write ros: {use_sim_time: true}",),
        )
    for use in context.launches:
        private = {id(one) for node in use.launched.nodes for one in node.parameters}
        for one in use.launched.parameters:
            is_set = one.name == _PARAMETER or (one.name == _PARAMETER[1:] and not use.namespace)
            if is_set and id(one) not in private and one.value in ("true", "1", "True"):
                yield Diagnostic(
                    "TIME008",
                    f"the launch file of {use.owner} sets `{_PARAMETER}` ({one.place})",
                    context.launch_span(use, "launch"),
                    label="only nodes that start later read it",
                    help=("write ros: {use_sim_time: true}, so that the master has it before any node",),
                )


@rule("TIME009", needs="domains")
def stopped_clocks(context: RuleContext) -> Iterator[Diagnostic]:
    """A node of ROS 2 takes its time from a clock that nothing on its island publishes."""
    programs = context.spec.programs
    waiting = {
        name: program.named_values[0]
        for name, program in programs.items()
        if program.named_values[1].get(_PARAMETER[1:]) in (True, "true", "True")
    }
    if not waiting:
        return
    ticking = bridged(context).get(CLOCK, set())
    hosts = [host for _, host, _ in _publishers(context)]
    hosts += [
        context.program_hosts[name]
        for name, one in programs.items()
        if one.use is None and not one.publishes and not (name in waiting and one.launch is None)
    ]
    hosts += [context.driving[name] for name, one in context.ros_drivers.items() if not one.publishes]
    ticking |= {home.name for host in hosts if (home := context.home.get(host or "")) is not None}
    for name, key in waiting.items():
        home = context.home.get(context.program_hosts[name] or "")
        if home is not None and home.name not in ticking:
            yield Diagnostic(
                "TIME009",
                f"program `{name}` takes its time from `{CLOCK}`, which nothing on its island publishes",
                context.span("programs", name, key, _PARAMETER[1:]),
                label="its time stands at 0",
                help=("remove it, or declare the clock at the simulator or player: " + _PUBLISHES,),
            )


def _publishers(context: RuleContext) -> Iterator[tuple[str, str | None, Span]]:
    """Yields what publishes the clock, its host, and its place."""
    for one in context.endpoints:
        if one.publishes and one.topic == CLOCK:
            yield f"program `{one.owner}`", one.host, context.span(*one.loc, "topic")
    for robot in context.ros_drivers:
        if any(one.name == CLOCK for one in context.driver_topics(robot)):
            span = context.span("robots", robot, key=True)
            yield f"the driver of robot `{robot}`", context.driving[robot], span
