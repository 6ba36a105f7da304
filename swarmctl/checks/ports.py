"""Whoever listens on a host finds its port free, and may take it."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec import edits
from swarmctl.spec.diagnostics import Diagnostic, Note, Severity, Span
from swarmctl.topology.ports import EPHEMERAL, HIGHEST, PRIVILEGED, SSH, Listener, free_master_port, offsets


def clashes(case: Case) -> Iterator[Diagnostic]:
    """PORT001, PORT002: two that would listen on one port of one address; the second never starts."""
    found: dict[tuple[object, int], list[Listener]] = {}
    for one in case.listeners:
        if one.protocol == "tcp":  # the discoveries of one address share their multicast port
            found.setdefault((_address(case, one.host), one.port), []).append(one)
    # One finding for all ports of two hosts; what runs comes before what may.
    told: dict[frozenset[str], tuple[Listener, Listener]] = {}
    for listeners in found.values():
        if len(listeners) < 2:
            continue
        first, *others = sorted(listeners, key=lambda one: not one.runs)
        for other in others:
            if not first.runs or first.what == other.what == SSH:  # ID001 tells of the latter
                continue
            pair = frozenset((first.host, other.host))
            if pair not in told or (other.runs and not told[pair][1].runs):
                told[pair] = (first, other)
    for first, other in told.values():
        yield _clash(case, first, other)


def _address(case: Case, host: str) -> object:
    return case.addresses[host] or case.spec.hosts[host].address


def _clash(case: Case, first: Listener, other: Listener) -> Diagnostic:
    address = case.spec.hosts[first.host].address
    moved = other.host if other.what != SSH else first.host
    free = _free_port(case, moved)
    change = edits.set_key(case.document.source, ("hosts", moved), "master_port", free)
    return Diagnostic(
        "PORT001" if other.runs else "PORT002",
        f"{first.what} of `{first.host}` and {other.what} of `{other.host}` "
        f"{'both listen' if other.runs else 'would both listen'} on port {first.port} of `{address}`",
        _place(case, other),
        severity=Severity.ERROR if other.runs else Severity.WARNING,
        label=f"{other.what} takes port {other.port}",
        notes=(Note(_place(case, first), f"{first.what} takes port {first.port}"),),
        help=(f"give host `{moved}` another one: master_port: {free}" if free else "move one of them",),
        fix=edits.mend(f"let the master of `{moved}` listen on port {free}", change) if free else None,
    )


def _place(case: Case, one: Listener) -> Span:
    """Where the port is written; for a default, the host that listens there."""
    host, ros = case.spec.hosts[one.host], case.spec.ros
    if one.loc[0] == "hosts":
        given = one.loc[2] in host.model_fields_set
    else:
        given = "master_port" in ros.model_fields_set and len(case.islands) == 1
    return case.span(*one.loc) if given else case.span("hosts", one.host, key=True)


def _free_port(case: Case, hub: str) -> int | None:
    """A port for the master of ``hub`` that, like its companions', is free at that address."""
    address = _address(case, hub)
    taken = {
        one.port
        for one in case.listeners
        if (one.host != hub or one.what == SSH) and _address(case, one.host) == address
    }
    return free_master_port(taken, offsets(case.spec, case.islands))


def ranges(case: Case) -> Iterator[Diagnostic]:
    """PORT003, PORT004, PORT005: a port beyond the last, one for root only, one that may be taken by then."""
    told: set[tuple[str | int, ...]] = set()
    for one in case.listeners:
        if not one.runs or one.what == SSH or one.loc in told:
            continue
        if one.port > HIGHEST:
            told.add(one.loc)
            yield Diagnostic(
                "PORT003",
                f"{one.what} of `{one.host}` would need port {one.port}; the highest is {HIGHEST}",
                case.span(*one.loc),
                label="its companions count from here",
                help=("choose a port near 11311",),
            )
        elif one.port in PRIVILEGED:
            told.add(one.loc)
            yield Diagnostic(
                "PORT004",
                f"{one.what} of `{one.host}` may not listen on port {one.port}; only root may",
                case.span(*one.loc),
                label=f"below {PRIVILEGED.stop}",
                help=("choose a port above it, such as 11311: the units run without privileges",),
            )
        elif one.port in EPHEMERAL:
            told.add(one.loc)
            yield Diagnostic(
                "PORT005",
                f"port {one.port} of {one.what} of `{one.host}` may be taken by any outgoing connection",
                case.span(*one.loc),
                severity=Severity.WARNING,
                label=f"Linux draws from {EPHEMERAL[0]} to {EPHEMERAL[-1]}",
                help=(f"choose a port below {EPHEMERAL[0]}, such as 11311",),
            )


def idle_ports(case: Case) -> Iterator[Diagnostic]:
    """PORT006: a host that runs no master has a port for one."""
    hubs = {island.hub for island in case.islands}
    for name, host in case.spec.hosts.items():
        if host.master_port is not None and name not in hubs:
            yield Diagnostic(
                "PORT006",
                f"host `{name}` runs no master; its `master_port` means nothing",
                case.span("hosts", name, "master_port"),
                severity=Severity.WARNING,
                label="nobody listens there",
                notes=_hub_of(case, name),
                help=("remove it; `ros: {master_port: ...}` is for the swarm's own master",),
                fix=edits.mend(
                    f"remove the port of `{name}`",
                    edits.remove(case.document.source, ("hosts", name, "master_port")),
                ),
            )


def _hub_of(case: Case, host: str) -> tuple[Note, ...]:
    island = case.home.get(host)
    return () if island is None else (Note(case.span("hosts", island.hub, key=True), "its master is here"),)


RULES: tuple[Rule, ...] = (clashes, ranges, idle_ports)
