"""Discovery between masters: peer lists, filters, groups, settings, and a common network."""

from __future__ import annotations

import ipaddress
from collections.abc import Collection, Iterator

from swarmctl.diagnostics import Diagnostic, Fix, Note
from swarmctl.linter.context import RuleContext, rule
from swarmctl.render.multimaster import Discovery, provider_of, providers_with
from swarmctl.spec.ros_model import Multimaster
from swarmctl.suggest import did_you_mean, nearest
from swarmctl.swarm.bridges import provider_name
from swarmctl.swarm.modes import MULTIMASTER
from swarmctl.yamltext.edits import append_item, make_fix, remove, replace_value
from swarmctl.yamltext.source import Loc

_OURS = ipaddress.ip_network("239.0.0.0/8")  # administratively scoped, RFC 2365
_LINK_LOCAL = ipaddress.ip_network("224.0.0.0/24")  # RFC 5771


def _settings(context: RuleContext) -> Multimaster | None:
    """Returns the multimaster settings; None if the mode has a single master, or nothing joins islands."""
    return context.spec.multimaster if context.spec.mode in MULTIMASTER and context.joins_islands else None


def discovering(context: RuleContext) -> tuple[Multimaster, Discovery] | None:
    """The same with the limits of the discovery; None where the provider discovers nothing (MM015)."""
    settings = _settings(context)
    found = (provider_of(settings, one).discovery for one in context.distros)
    limits = next((one for one in found if one is not None), None)
    return (settings, limits) if settings is not None and limits is not None else None


@rule("MM001")
def strangers(context: RuleContext) -> Iterator[Diagnostic]:
    """Lists of masters name a host that runs none."""
    found = discovering(context)
    if found is None:
        return
    settings, _ = found
    hubs = {island.hub: None for island in context.islands}
    meant: set[tuple[Loc, str]] = set()
    for loc, name, beside in _masters_named(settings):
        if name in hubs:
            continue
        home, others = context.home.get(name), [one for one in hubs if one not in (beside or ())]
        near = nearest(name, others) if name not in context.spec.hosts else None
        is_free = near is not None and beside is not None and (loc[:-1], near) not in meant
        meant |= {(loc[:-1], near)} if near else set()
        yield Diagnostic(
            "MM001",
            f"`{name}` runs no master" if name in context.spec.hosts else f"unknown host `{name}`",
            context.span(*loc, key=beside is None),
            label="only hosts that run a master can be listed",
            help=(f"name `{home.hub}`, which runs the master of `{name}`",)
            if home is not None
            else did_you_mean(name, others, "the hosts with a master are"),
            fix=make_fix(f"write `{near}`", replace_value(context.source, loc, near), safe=False)
            if is_free
            else None,
        )


def _masters_named(settings: Multimaster) -> Iterator[tuple[Loc, str, Collection[str] | None]]:
    """Yields the place and name of every listed master, and what cannot stand there too; None for a key."""
    for hub, peers in settings.robot_hosts.items():
        yield ("multimaster", "robot_hosts", hub), hub, None
        for index, name in enumerate(peers):
            yield ("multimaster", "robot_hosts", hub, index), name, (hub, *peers)
    for key in ("sync_hosts", "ignore_hosts"):
        listed = getattr(settings, key)
        for index, name in enumerate(listed):
            yield ("multimaster", key, index), name, listed


@rule("MM002")
def one_sided_peers(context: RuleContext) -> Iterator[Diagnostic]:
    """A peer list without its counterpart; a hub without a list has all other hubs as peers."""
    found = discovering(context)
    if found is None:
        return
    settings, _ = found
    for hub, peers in settings.robot_hosts.items():
        for index, other in enumerate(peers):
            back = settings.robot_hosts.get(other)
            if other == hub or back is None or hub in back or multicast(context, hub, other) is True:
                continue
            loc = ("multimaster", "robot_hosts", other)
            yield Diagnostic(
                "MM002",
                f"`{hub}` lists `{other}` as a peer, but `{other}` does not list `{hub}`",
                context.span("multimaster", "robot_hosts", hub, index),
                label="one-sided peer",
                notes=(Note(context.span(*loc), f"the peers of `{other}`"),),
                help=(f"add `{hub}` to the list of `{other}`",),
                fix=_appended(context, back, loc, hub, f"add `{hub}` to the list of `{other}`"),
            )


def multicast(context: RuleContext, one: str, other: str) -> bool | None:
    """Returns whether multicast passes between two hosts, or None if unknown."""
    shared = context.shared_networks(one, other) if one in context.spec.hosts else []
    known = [context.network_at[index].multicast for index in shared]
    return True if True in known else None if None in known else False


@rule("MM003")
def both_filters(context: RuleContext) -> Iterator[Diagnostic]:
    """Both filters are set, so masters in neither list are accepted."""
    found = discovering(context)
    if found is not None and found[0].sync_hosts and found[0].ignore_hosts:
        yield Diagnostic(
            "MM003",
            "`sync_hosts` and `ignore_hosts` cannot both be set",
            context.span("multimaster", "ignore_hosts", key=True),
            label="masters in neither list are accepted",
            notes=(Note(context.span("multimaster", "sync_hosts", key=True), "the other filter"),),
            help=("keep only `sync_hosts`; hosts that it does not list stay out",),
            fix=make_fix(
                "remove `ignore_hosts`", remove(context.source, ("multimaster", "ignore_hosts")), safe=False
            ),
        )


@rule("MM004")
def groups(context: RuleContext) -> Iterator[Diagnostic]:
    """A multicast group reserved for other protocols."""
    found = discovering(context)
    if found is None or "group" not in found[0].model_fields_set or found[0].group == found[1].group:
        return
    settings, limits = found
    group = ipaddress.IPv4Address(settings.group)
    if group not in _OURS:
        ours = f"239.255.{settings.group.split('.', 2)[2]}"
        loc = ("multimaster", "group")
        yield Diagnostic(
            "MM004",
            f"multicast group {settings.group} is reserved for other protocols",
            context.span(*loc),
            label="for link-local protocols such as mDNS" if group in _LINK_LOCAL else "assigned by IANA",
            help=(f"leave it out ({limits.group}), or use one in 239.0.0.0/8, such as {ours}",),
            fix=make_fix(f"write {ours}", replace_value(context.source, loc, ours), safe=False),
        )


@rule("MM006")
def memories(context: RuleContext) -> Iterator[Diagnostic]:
    """A master is removed before its state is requested."""
    found = discovering(context)
    if found is None or found[0].remove_after > found[0].active_request_after:
        return
    settings, limits = found
    declared = settings.model_fields_set
    key = "remove_after" if "remove_after" in declared else "active_request_after"
    longer = settings.active_request_after * limits.forget_factor
    yield Diagnostic(
        "MM006",
        f"a master is removed after {settings.remove_after:g} s without a heartbeat, "
        f"but its state is requested only after {settings.active_request_after:g} s",
        context.span("multimaster", key),
        label="removed before the request",
        notes=(Note(context.span("multimaster", "active_request_after"), "time until the request"),)
        if declared >= {"remove_after", "active_request_after"}
        else (),
        help=(f"set a longer `remove_after`, such as {longer:g}",),
        fix=make_fix(
            f"write {longer:g}",
            replace_value(context.source, ("multimaster", "remove_after"), float(longer)),
            safe=False,
        )
        if key == "remove_after"
        else None,
    )


@rule("MM015")
def unused_settings(context: RuleContext) -> Iterator[Diagnostic]:
    """Settings that the provider does not read."""
    settings = _settings(context)
    if settings is None:
        return
    used = {provider_name(settings, one): provider_of(settings, one) for one in context.distros}
    read = {"provider", "topics"}.union(*(one.settings for one in used.values()))
    for key in type(settings).model_fields:
        if key in settings.model_fields_set and key not in read:
            others = " or ".join(f"`provider: {name}`" for name in providers_with(key))
            yield Diagnostic(
                "MM015",
                f"provider `{'` and `'.join(used)}` does not use `{key}`",
                context.span("multimaster", key, key=True),
                label="has no effect",
                notes=(Note(context.span("multimaster", "provider"), "the provider"),),
                help=(f"remove it, or write {others}" if others else "remove it",),
                fix=make_fix(
                    f"remove `{key}`", remove(context.source, ("multimaster", key)), safe=not others
                ),
            )


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
            if not context.reaches(one, other):
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


@rule("MM008")
def discovery_over_ipv4(context: RuleContext) -> Iterator[Diagnostic]:
    """Discovery by an IPv4 group between masters that reach each other over IPv6."""
    if context.spec.ros.ipv6 and (found := discovering(context)) is not None:
        yield Diagnostic(
            "MM008",
            f"masters cannot find each other over IPv6: the discovery uses the IPv4 group {found[0].group}",
            context.span("ros", "ipv6"),
            label="nodes and masters use IPv6",
            help=("write `multimaster: {provider: static}`, whose masters know each other from the spec",),
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
            fix=make_fix(
                f"remove `{hub}`",
                remove(context.source, ("multimaster", key, settings.ignore_hosts.index(hub))),
                safe=False,
            )
            if ignored
            else _appended(context, settings.sync_hosts, ("multimaster", "sync_hosts"), hub, f"add `{hub}`"),
        )


def _appended(context: RuleContext, listed: Collection[str], loc: Loc, hub: str, title: str) -> Fix | None:
    """Returns the fix that adds a master to a list; None if a wrong name in it may mean that one."""
    if not {island.hub for island in context.islands}.issuperset(listed):
        return None
    return make_fix(title, append_item(context.source, loc, hub), safe=False)
