"""Several masters hear of each other: who greets whom, how often, and who is listened to."""

from __future__ import annotations

import ipaddress
from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Note, Severity
from swarmctl.spec.edits import append_item, mend, remove, replace_value
from swarmctl.spec.multimaster import Multimaster
from swarmctl.spec.source import Loc
from swarmctl.spec.suggest import did_you_mean, nearest
from swarmctl.topology.modes import MULTIMASTER

# Of fkie's master_discovery (multimaster_fkie 0.8).
_DEFAULT_GROUP = "226.0.0.0"
_QUALITY_HZ = 0.1  # below it there is no link quality
_STEADY_HZ = 0.3  # below it masters were seen to flap, fkie/multimaster_fkie#46
_MANY = 5
_FOR_PYTHON_2 = "multimaster_fkie"  # 0.8.12, the last of them, has print statements
_FKIES_OWN = (
    "packages", "group", "port", "heartbeat_hz", "active_request_after", "remove_after",
    "robot_hosts", "sync_hosts", "ignore_hosts",
)  # fmt: skip
_OURS = ipaddress.ip_network("239.0.0.0/8")  # administratively scoped, RFC 2365
_LINK_LOCAL = ipaddress.ip_network("224.0.0.0/24")  # RFC 5771


def _settings(case: Case) -> Multimaster | None:
    """What the spec says about several masters, where its mode has them."""
    return case.spec.multimaster if case.spec.mode in MULTIMASTER else None


def _of_fkie(case: Case) -> Multimaster | None:
    """The same where fkie's packages join them; with another provider most of it has no effect (MM015)."""
    settings = _settings(case)
    return settings if settings is not None and settings.provider == "fkie" else None


def strangers(case: Case) -> Iterator[Diagnostic]:
    """MM001: lists of masters name a host that runs none."""
    settings = _of_fkie(case)
    if settings is None:
        return
    hubs = {island.hub: None for island in case.islands}
    for loc, name, is_key in _masters_named(settings):
        if name in hubs:
            continue
        home = case.home.get(name)
        near = nearest(name, tuple(hubs)) if name not in case.spec.hosts else None
        yield Diagnostic(
            "MM001",
            f"`{name}` runs no master" if name in case.spec.hosts else f"there is no host called `{name}`",
            case.span(*loc, key=is_key),
            label="masters greet masters",
            help=(f"name `{home.hub}`, which runs the master of `{name}`",)
            if home is not None
            else did_you_mean(name, hubs, "the hosts with a master are"),
            fix=mend(f"write `{near}`", replace_value(case.source, loc, near))
            if near and not is_key
            else None,
        )


def _masters_named(settings: Multimaster) -> Iterator[tuple[Loc, str, bool]]:
    """Every place at which a master's host is named, the name, and whether it is a key."""
    for hub, greeted in settings.robot_hosts.items():
        yield ("multimaster", "robot_hosts", hub), hub, True
        for index, name in enumerate(greeted):
            yield ("multimaster", "robot_hosts", hub, index), name, False
    for key in ("sync_hosts", "ignore_hosts"):
        for index, name in enumerate(getattr(settings, key)):
            yield ("multimaster", key, index), name, False


def one_sided_greetings(case: Case) -> Iterator[Diagnostic]:
    """MM002: one master greets another that does not greet it back; a hub without a list greets all."""
    settings = _of_fkie(case)
    if settings is None:
        return
    for hub, greeted in settings.robot_hosts.items():
        for index, other in enumerate(greeted):
            back = settings.robot_hosts.get(other)
            if other == hub or back is None or hub in back or _multicast(case, hub, other) is True:
                continue
            loc = ("multimaster", "robot_hosts", other)
            yield Diagnostic(
                "MM002",
                f"`{hub}` greets `{other}`, but `{other}` does not greet `{hub}`",
                case.span("multimaster", "robot_hosts", hub, index),
                label="known on one side only",
                notes=(Note(case.span(*loc), f"whom `{other}` greets"),),
                help=(f"add `{hub}` to the list of `{other}`",),
                fix=mend(f"add `{hub}` to the list of `{other}`", append_item(case.source, loc, hub)),
            )


def _multicast(case: Case, one: str, other: str) -> bool | None:
    """Whether multicast passes between two hosts: surely, surely not, or unknown."""
    known = [link.multicast for index, link in case.networks_of.get(one, ()) if other in case.members[index]]
    return True if True in known else None if None in known else False


def both_filters(case: Case) -> Iterator[Diagnostic]:
    """MM003: with both filters set, a master that is in neither is still listened to."""
    settings = _of_fkie(case)
    if settings is not None and settings.sync_hosts and settings.ignore_hosts:
        yield Diagnostic(
            "MM003",
            "`sync_hosts` and `ignore_hosts` cannot both be set",
            case.span("multimaster", "ignore_hosts", key=True),
            label="masters in neither list are let in",
            notes=(Note(case.span("multimaster", "sync_hosts", key=True), "the other filter"),),
            help=("keep `sync_hosts`: what it does not name stays out",),
            fix=mend("remove `ignore_hosts`", remove(case.source, ("multimaster", "ignore_hosts"))),
        )


def groups(case: Case) -> Iterator[Diagnostic]:
    """MM004: a multicast group that belongs to something else."""
    settings = _of_fkie(case)
    if settings is None or settings.group == _DEFAULT_GROUP:
        return
    group = ipaddress.IPv4Address(settings.group)
    if group not in _OURS:
        ours = f"239.255.{settings.group.split('.', 2)[2]}"
        loc = ("multimaster", "group")
        yield Diagnostic(
            "MM004",
            f"the multicast group {settings.group} belongs to others",
            case.span(*loc),
            severity=Severity.WARNING,
            label="for protocols of the local link, such as mDNS" if group in _LINK_LOCAL else "handed out",
            help=(f"leave it out ({_DEFAULT_GROUP}), or take one of 239.0.0.0/8, such as {ours}",),
            fix=mend(f"write {ours}", replace_value(case.source, loc, ours)),
        )


def heartbeats(case: Case) -> Iterator[Diagnostic]:
    """MM005, MM009: so few heartbeats that a lost robot is noticed late, or that many masters flap."""
    settings = _of_fkie(case)
    if settings is None:
        return
    rate, loc = settings.heartbeat_hz, ("multimaster", "heartbeat_hz")
    fix = mend("write 1.0", replace_value(case.source, loc, 1.0))
    if rate < _QUALITY_HZ:
        yield Diagnostic(
            "MM005",
            f"with a heartbeat every {1 / rate:g} s the loss of a robot is noticed after minutes",
            case.span(*loc),
            severity=Severity.WARNING,
            label=f"no link quality below {_QUALITY_HZ:g} Hz",
            help=("leave it out: 1 Hz, 68 bytes a second to each other master",),
            fix=fix,
        )
    elif rate < _STEADY_HZ and len(case.islands) > _MANY:
        yield Diagnostic(
            "MM009",
            f"{len(case.islands)} masters with a heartbeat every {1 / rate:.3g} s may flap",
            case.span(*loc),
            severity=Severity.WARNING,
            label="now online, now offline",
            help=(f"leave it out: 1 Hz; above {_MANY} masters take {_STEADY_HZ:g} Hz at least",),
            fix=fix,
        )


def memories(case: Case) -> Iterator[Diagnostic]:
    """MM006: a master is forgotten before it is asked whether it is still there."""
    settings = _of_fkie(case)
    if settings is None or settings.remove_after > settings.active_request_after:
        return
    said = settings.model_fields_set
    key = "remove_after" if "remove_after" in said else "active_request_after"
    longer = settings.active_request_after * 5  # as fkie's own two are
    yield Diagnostic(
        "MM006",
        f"a master is forgotten after {settings.remove_after:g} s of silence, "
        f"and asked only after {settings.active_request_after:g} s",
        case.span("multimaster", key),
        label="never asked",
        notes=(Note(case.span("multimaster", "active_request_after"), "asked after this"),)
        if said >= {"remove_after", "active_request_after"}
        else (),
        help=(f"let `remove_after` be longer, such as {longer:g}",),
        fix=mend(
            f"write {longer:g}", replace_value(case.source, ("multimaster", "remove_after"), float(longer))
        )
        if key == "remove_after"
        else None,
    )


def parted_islands(case: Case) -> Iterator[Diagnostic]:
    """MM007, MM008: a topic crosses between masters that share no network, or that never meet."""
    settings = _of_fkie(case)
    hubs = {island.name: island.hub for island in case.islands}
    seen: set[frozenset[str]] = set()
    for bridge in case.bridges:
        for to in bridge.to:
            one, other = hubs[bridge.origin], hubs[to]
            if frozenset((one, other)) in seen:
                continue
            seen.add(frozenset((one, other)))
            if not any(other in case.members[index] for index, _ in case.networks_of[one]):
                yield Diagnostic(
                    "MM007",
                    f"`{bridge.topic}` crosses from `{one}` to `{other}`, which share no network",
                    case.span("hosts", other, key=True),
                    label="no wlan or ethernet joins the two",
                    notes=(Note(case.span("hosts", one, key=True), "where it comes from"),),
                    help=(f"put both on one network: {{kind: wlan, name: ..., hosts: [{one}, {other}]}}",),
                )
            elif settings is not None and _never_meet(case, settings, one, other):
                loc = ("multimaster", "robot_hosts", one)
                yield Diagnostic(
                    "MM008",
                    f"`{one}` and `{other}` never meet: multicast does not pass, and neither greets",
                    case.span(*loc, key=True),
                    label=f"`{bridge.topic}` is to cross between them",
                    notes=(Note(case.span("multimaster", "robot_hosts", other, key=True), "nor this one"),),
                    help=(
                        "add each to the list of the other; or leave `robot_hosts` out, and all greet all",
                    ),
                    fix=mend(
                        "let them greet each other",
                        append_item(case.source, loc, other),
                        append_item(case.source, ("multimaster", "robot_hosts", other), one),
                    ),
                )


def _never_meet(case: Case, settings: Multimaster, one: str, other: str) -> bool:
    lists = settings.robot_hosts
    return (
        other not in lists.get(one, (other,))
        and one not in lists.get(other, (one,))
        and _multicast(case, one, other) is False
    )


def shut_out(case: Case) -> Iterator[Diagnostic]:
    """MM014: a topic is to cross from a master that the filters leave out."""
    settings = _of_fkie(case)
    if settings is None or not (settings.sync_hosts or settings.ignore_hosts):
        return
    hubs = {island.name: island.hub for island in case.islands}
    told: set[str] = set()
    for bridge in case.bridges:
        hub = hubs[bridge.origin]
        out = hub in settings.ignore_hosts or (settings.sync_hosts and hub not in settings.sync_hosts)
        if not out or hub in told:
            continue
        told.add(hub)
        ignored = hub in settings.ignore_hosts
        key = "ignore_hosts" if ignored else "sync_hosts"
        yield Diagnostic(
            "MM014",
            f"`{bridge.topic}` is to cross from `{hub}`, which nobody listens to",
            case.span("multimaster", key, settings.ignore_hosts.index(hub))
            if ignored
            else case.span("multimaster", key),
            label="left out here" if ignored else f"`{hub}` is not among them",
            help=(f"take `{hub}` out of the list" if ignored else f"add `{hub}` to `sync_hosts`",),
            fix=None
            if ignored
            else mend(f"add `{hub}`", append_item(case.source, ("multimaster", "sync_hosts"), hub)),
        )


def idle_settings(case: Case) -> Iterator[Diagnostic]:
    """MM015: settings of fkie's discovery, for a provider that discovers nothing."""
    settings = _settings(case)
    if settings is None or settings.provider == "fkie":
        return
    for key in _FKIES_OWN:
        if key in settings.model_fields_set:
            yield Diagnostic(
                "MM015",
                f"provider `{settings.provider}` knows its peers and has no `{key}`",
                case.span("multimaster", key, key=True),
                severity=Severity.WARNING,
                label="has no effect",
                notes=(Note(case.span("multimaster", "provider"), "the provider"),),
                help=("remove it, or write `provider: fkie`",),
                fix=mend(f"remove `{key}`", remove(case.source, ("multimaster", key))),
            )


def outdated_packages(case: Case) -> Iterator[Diagnostic]:
    """MM016: packages for Python 2, which the hosts' ROS has left behind."""
    settings = _of_fkie(case)
    if settings is None or settings.packages != _FOR_PYTHON_2:
        return
    loc = ("multimaster", "packages")
    yield Diagnostic(
        "MM016",
        f"`{_FOR_PYTHON_2}` is Python 2, and ROS {case.spec.ros.distro} runs Python 3",
        case.span(*loc),
        severity=Severity.WARNING,
        label="as published it does not start",
        help=("leave it out: `fkie_multimaster` (1.x) is part of Noetic",),
        fix=mend("remove `packages`", remove(case.source, loc)),
    )


RULES: tuple[Rule, ...] = (
    strangers,
    one_sided_greetings,
    both_filters,
    groups,
    heartbeats,
    memories,
    parted_islands,
    shut_out,
    idle_settings,
    outdated_packages,
)
