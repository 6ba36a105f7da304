"""The ports of masters, domains, discovery and SSH: unique and usable."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.analysis.listeners import master_offsets
from swarmctl.diagnostics import Diagnostic, Note, Span
from swarmctl.linter.context import RuleContext, rule
from swarmctl.swarm.ports import (
    EPHEMERAL,
    SSH,
    USUAL_MASTER,
    Listener,
    free_master_port,
)
from swarmctl.yamltext import edits


@rule("PORT001", "PORT002")
def clashes(context: RuleContext) -> Iterator[Diagnostic]:
    """Two servers on one port of one address; the second one does not start."""
    found: dict[tuple[object, int, str], list[Listener]] = {}
    for one in (*context.listeners, *_of_programs(context)):
        found.setdefault((_address(context, one.host), one.port, one.protocol), []).append(one)
    # One finding for all ports of two hosts or of two drivers; servers that always run come first.
    reported: dict[frozenset[str], tuple[Listener, Listener]] = {}
    for listeners in found.values():
        if len(listeners) < 2:
            continue
        first, *others = sorted(listeners, key=lambda one: not one.runs)
        for other in others:
            if not first.runs or first.what == other.what == SSH:  # ID001 reports the latter
                continue
            if (first.host, first.what) == (other.host, other.what):  # the hub of two islands, by mistake
                continue
            if first.what == other.what and first.protocol == "udp":  # discoveries share their multicast port
                continue
            pair = frozenset((_owner(first), _owner(other)))
            if pair not in reported or (other.runs and not reported[pair][1].runs):
                reported[pair] = (first, other)
    for first, other in reported.values():
        yield _clash(context, first, other)


#: Packages whose node serves browsers and viewers at its parameter `port`, with the default.
_SERVERS = {"rosbridge_server": 9090, "web_video_server": 8080, "foxglove_bridge": 8765}


def _of_programs(context: RuleContext) -> Iterator[Listener]:
    """Yields the ports of known servers that are programs; of one bound to an address that is not known."""
    for name, program in context.spec.programs.items():
        usual, host = _SERVERS.get(program.package or ""), context.program_hosts[name]
        if usual is None or host is None or program.lifecycle != "service":
            continue
        key, values = program.named_values
        port = values.get("port", usual)
        if (
            isinstance(port, int)
            and port > 0
            and "address" not in values
            and "udp" not in str(program.executable)
        ):
            loc = ("programs", name, *((key, "port") if "port" in values else ()))
            yield Listener(host, port, f"program `{name}`", loc)


def _owner(one: Listener) -> str:
    """Returns whose port it is: a robot's driver, a program, or the host of the swarm's own servers."""
    return one.what if one.of_robot or one.loc[0] == "programs" else one.host


def _address(context: RuleContext, host: str) -> object:
    return context.addresses[host] or context.spec.hosts[host].address


def _clash(context: RuleContext, first: Listener, other: Listener) -> Diagnostic:
    address = context.spec.hosts[first.host].address
    moved, one = (other.host, other) if other.what != SSH else (first.host, first)
    free = _free_port(context, moved) if _of_a_master(one) else None
    change = edits.set_key(context.document.source, ("hosts", moved), "master_port", free)
    return Diagnostic(
        "PORT001" if other.runs else "PORT002",
        f"{first.what} of `{first.host}` and {other.what} of `{other.host}` "
        f"{'both listen' if other.runs else 'would both listen'} on "
        f"{'UDP ' if first.protocol == 'udp' else ''}port {first.port} of `{address}`",
        _place(context, other),
        label=f"{other.what} uses port {other.port}",
        notes=(Note(_place(context, first), f"{first.what} uses port {first.port}"),),
        help=(
            f"set another one on host `{moved}`: master_port: {free}"
            if free
            else "write other `local_ports` in one of the links, and in the robot, as UXRCE_DDS_PRT of a PX4"
            if one.of_robot
            else "write another `domain` in `ros`, whose ports are free"
            if _of_a_domain(first) or _of_a_domain(other)
            else "change one of the ports",
        ),
        fix=edits.make_fix(f"set the master port of `{moved}` to {free}", change, safe=False)
        if free
        else None,
    )


def _of_a_master(one: Listener) -> bool:
    """True if ``master_port`` sets the port, or that from which it is counted."""
    return one.loc[-1] == "master_port"


def _of_a_domain(one: Listener) -> bool:
    """True if the port follows from the domain of an island."""
    return one.loc == ("ros", "domain")


def _place(context: RuleContext, one: Listener) -> Span:
    """Returns the place of the port in the spec; for a default, the host that listens there."""
    host, ros = context.spec.hosts[one.host], context.spec.ros
    if one.of_robot or one.loc[0] == "programs":
        return context.span(*one.loc, key=len(one.loc) == 2)
    if one.loc[0] == "hosts":
        given = one.loc[2] in host.model_fields_set
    else:
        key = one.loc[1]
        given = key in ros.model_fields_set and (key != "master_port" or len(context.islands) == 1)
    return context.span(*one.loc) if given else context.span("hosts", one.host, key=True)


def _free_port(context: RuleContext, hub: str) -> int | None:
    """Returns a port for the master of ``hub`` that is free there, with the ports derived from it."""
    address = _address(context, hub)
    taken = {
        one.port
        for one in context.listeners
        if (one.host != hub or one.what == SSH) and _address(context, one.host) == address
    }
    return free_master_port(taken, master_offsets(context.spec, context.islands))


@rule("PORT005")
def ephemeral_ports(context: RuleContext) -> Iterator[Diagnostic]:
    """A port in the ephemeral range."""
    reported: set[tuple[str | int, ...]] = set()
    for one in context.listeners:
        if not one.runs or one.what == SSH or one.loc in reported or one.port not in EPHEMERAL:
            continue
        reported.add(one.loc)
        usual = f", such as {USUAL_MASTER}" if one.loc[-1] == "master_port" else ""
        below = f"choose a port below {EPHEMERAL[0]}{usual}"
        yield Diagnostic(
            "PORT005",
            f"port {one.port} of {one.what} of `{one.host}` may be in use by an outgoing connection",
            _place(context, one) if _of_a_domain(one) else context.span(*one.loc),
            label=f"Linux assigns {EPHEMERAL[0]} to {EPHEMERAL[-1]}",
            help=("write a smaller `domain` in `ros`" if _of_a_domain(one) else below,),
        )
