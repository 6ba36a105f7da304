"""Hosts that have to communicate share a network, and their addresses are on it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from swarmctl.diagnostics import Diagnostic, Fix, Note
from swarmctl.links.network_link import Wlan
from swarmctl.linter.context import RuleContext, rule
from swarmctl.rules.addresses import wanted_version
from swarmctl.swarm.addresses import Subnet
from swarmctl.swarm.wireguard_routes import Networks
from swarmctl.yamltext.edits import append_item, make_fix

_SHOWN = 5  # hosts in a message


@rule("NET001")
def paths_to_hub(context: RuleContext) -> Iterator[Diagnostic]:
    """A host that reaches its hub over no network."""
    for island in context.islands:
        if len(island.hosts) > 1 and not context.networks_of[island.hub] and context.networks:
            yield _hub_alone(context, island.hub, [name for name in island.hosts if name != island.hub])
            continue
        for name in island.hosts:
            if not context.reaches(name, island.hub):
                yield Diagnostic(
                    "NET001",
                    f"host `{name}` cannot reach its hub `{island.hub}`",
                    context.span("hosts", name, key=True),
                    label="no wlan or ethernet has both hosts",
                    help=(_network_help(context, name, island.hub),),
                    fix=_network_fix(context, name, island.hub),
                )


def _hub_alone(context: RuleContext, hub: str, others: list[str]) -> Diagnostic:
    """Returns the one finding for a hub on no network, which all its hosts would report."""
    place = {name: [index for index, _ in context.networks_of[name]] for name in others}
    shared = [index for index in place[others[0]] if all(index in place[name] for name in others)]
    shown = ", ".join(f"`{link.name}`" for index, link in context.networks if index in shared)
    where = f"the hosts of {shown}" if shown else "the hosts of a network that its hosts are on"
    names = "`, `".join(others if len(others) < _SHOWN else [*others[: _SHOWN - 1], "..."])
    fix = None
    if len(shared) == 1 and len(context.networks) == 1:
        fix = make_fix(
            f"add `{hub}` to {where}",
            append_item(context.source, ("links", shared[0], "hosts"), hub),
            safe=False,
        )
    return Diagnostic(
        "NET001",
        f"hub `{hub}` is on no network; no other host reaches it: `{names}`",
        context.span("hosts", hub, key=True),
        label="not in any wlan or ethernet",
        help=(f"add `{hub}` to {where}",),
        fix=fix,
    )


def _network_help(context: RuleContext, name: str, hub: str) -> str:
    if context.networks_of[hub]:
        return f"add `{name}` to the hosts of `{context.networks_of[hub][0][1].name}`"
    return f"add to `links`: {{kind: wlan, name: lab, hosts: [{hub}, {name}]}}"


def _network_fix(context: RuleContext, name: str, hub: str) -> Fix | None:
    """Returns the fix that adds the host to its hub's only network, if its address is in the subnet."""
    if len(context.networks_of[hub]) != 1:
        return None
    [(index, link)] = context.networks_of[hub]
    ip, subnet = context.addresses[name], context.subnets[index]
    if ip is not None and subnet is not None and ip not in subnet:
        return None
    edits = append_item(context.source, ("links", index, "hosts"), name)
    return make_fix(f"add `{name}` to the hosts of `{link.name}`", edits, safe=False)


@rule("NET014")
def hosts_alone(context: RuleContext) -> Iterator[Diagnostic]:
    """A host on no network, in a swarm of several hosts. NET001 reports hosts without their hub."""
    if len(context.spec.hosts) < 2:
        return
    for name in context.spec.hosts:
        home = context.home.get(name)
        is_isolated = not context.topology[name] and (home is None or len(home.hosts) == 1)
        if is_isolated and name not in context.jump_hosts:
            yield Diagnostic(
                "NET014",
                f"host `{name}` is on no network",
                context.span("hosts", name, key=True),
                label="not in any wlan or ethernet",
                help=("add it to the hosts of a network, or add a network to `links`",),
            )


@rule("NET006")
def addresses_towards_hubs(context: RuleContext) -> Iterator[Diagnostic]:
    """A host on several networks whose address is not on the one that it shares with its hub."""
    yield from _unreachable(context, _with_their_hubs(context))


@rule("NET006")
def addresses_towards_masters(context: RuleContext) -> Iterator[Diagnostic]:
    """A hub whose address is not on the network that it shares with a hub it exchanges topics with."""
    hubs = {island.name: island.hub for island in context.islands}
    pairs = [(hubs[bridge.origin], hubs[to]) for bridge in context.bridges for to in bridge.to]
    yield from _unreachable(context, dict.fromkeys((min(pair), max(pair)) for pair in pairs))


def _with_their_hubs(context: RuleContext) -> Iterator[tuple[str, str]]:
    for island in context.islands:
        yield from ((name, island.hub) for name in island.hosts if name != island.hub)


def _unreachable(context: RuleContext, pairs: Iterable[tuple[str, str]]) -> Iterator[Diagnostic]:
    """Of hosts that exchange messages, those whose address is not on the network that both share.

    WireGuard needs one address of the two, and answers where a packet came from.
    """
    strangers: dict[tuple[str, int], list[str]] = {}
    sealed = Networks(context) if context.spec.has_wireguard else None
    for name, hub in pairs:
        if sealed is not None and sealed.joins(name, hub):
            continue
        if len(context.networks_of[name]) + len(context.networks_of[hub]) < 3:
            continue
        joining = context.shared_networks(name, hub)
        for one, peer in ((name, hub), (hub, name)):
            if joining and _is_elsewhere(context, one, joining):
                strangers.setdefault((one, joining[0]), []).append(peer)
    for (name, index), peers in strangers.items():
        more = f" and {len(peers) - 1} more" if len(peers) > 1 else ""
        yield Diagnostic(
            "NET006",
            f"`{name}` shares `{context.network_at[index].name}` with `{peers[0]}`{more}, "
            f"but its address is on another network",
            context.span("hosts", name, "address"),
            label="advertised by its nodes",
            notes=(Note(context.span("links", index, "name"), "the shared network"),),
            help=(f"write the address that `{name}` has on that network, or put both on one network",),
        )


def _is_elsewhere(context: RuleContext, host: str, joining: list[int]) -> bool:
    """True if the address of ``host`` is on one of its networks, but on none of ``joining``."""
    ip = context.addresses[host]
    homes = [
        index
        for index, _ in context.networks_of[host]
        if ip is not None and (subnet := context.subnets[index]) is not None and ip in subnet
    ]
    return bool(homes) and not any(index in joining or context.subnets[index] is None for index in homes)


@rule("NET012")
def unclear_names(context: RuleContext) -> Iterator[Diagnostic]:
    """A host on several networks that is addressed by name."""
    for name, networks in context.networks_of.items():
        if len(networks) > 1 and context.addresses[name] is None and name in context.home:
            yield Diagnostic(
                "NET012",
                f"the name of host `{name}` may resolve to an address on any of its {len(networks)} networks",
                context.span("hosts", name, "address"),
                label="a name, not an address",
                notes=tuple(
                    Note(context.span("links", index, "name"), "one network") for index, _ in networks[:2]
                ),
                help=(f"write the {wanted_version(context)} address that it has on the network of its hub",),
            )


@rule("NET008")
def overlapping_networks(context: RuleContext) -> Iterator[Diagnostic]:
    """Networks with overlapping subnets and a common host."""
    known = [(subnet, index) for index, subnet in context.subnets.items() if subnet is not None]
    ordered = sorted(known, key=lambda one: (one[0].version, one[0], one[1]))
    widest: list[tuple[Subnet, int]] = []  # enclosing subnets of the next one
    for subnet, index in ordered:
        while widest and not (widest[-1][0].version == subnet.version and widest[-1][0].overlaps(subnet)):
            widest.pop()
        for _, earlier in widest:
            if (
                context.network_at[earlier].name != context.network_at[index].name
            ):  # otherwise ID004 reports it
                yield from _overlap(context, *sorted((earlier, index)))
        widest.append((subnet, index))


def _overlap(context: RuleContext, first: int, second: int) -> Iterator[Diagnostic]:
    one, other = context.network_at[first], context.network_at[second]
    hosts = set(one.hosts)
    both = next((host for host in other.hosts if host in hosts), None)
    if both is None:
        return
    named = [f"`{link.name}` ({context.subnets[index]})" for index, link in ((first, one), (second, other))]
    yield Diagnostic(
        "NET008",
        f"networks {' and '.join(named)} overlap, and host `{both}` is on both",
        context.span("links", second, "subnet" if other.subnet else "name"),
        label="overlapping subnet",
        notes=(Note(context.span("links", first, "subnet" if one.subnet else "name"), "the other network"),),
        help=(
            "if an access point bridges the two, list all hosts in one network",
            "otherwise give each network its own `subnet`",
        ),
    )


@rule("NET013")
def isolated_clients(context: RuleContext) -> Iterator[Diagnostic]:
    """Hosts that have to communicate share only a wlan with client isolation."""
    isolated = {
        index for index, link in context.networks if isinstance(link, Wlan) and link.client_isolation is True
    }
    if not isolated:
        return
    apart: dict[int, list[tuple[str, str]]] = {}
    for name, peer in dict.fromkeys(_communicating(context)):
        joining = context.shared_networks(name, peer)
        if joining and isolated.issuperset(joining):
            apart.setdefault(joining[0], []).append((name, peer))
    for index, pairs in apart.items():
        (name, peer), more = pairs[0], len(pairs) - 1
        yield Diagnostic(
            "NET013",
            f"`{name}` and `{peer}`{f' (and {more} more)' if more else ''} have to communicate over "
            f"`{context.network_at[index].name}`, which isolates its clients",
            context.span("links", index, "client_isolation"),
            label="no packet passes between two clients",
            help=("turn off client isolation at the access point, or connect the hosts by another network",),
        )


def _communicating(context: RuleContext) -> Iterator[tuple[str, str]]:
    """Yields the pairs of hosts that have to communicate: member and hub, and bridged hubs."""
    hubs = {island.name: island.hub for island in context.islands}
    for island in context.islands:
        yield from ((name, island.hub) for name in island.hosts if name != island.hub)
    for bridge in context.bridges:
        yield from ((hubs[bridge.origin], hubs[to]) for to in bridge.to if to in hubs)


@rule("NET015")
def jumps(context: RuleContext) -> Iterator[Diagnostic]:
    """A jump host that shares no network with the host behind it."""
    for name, host in context.spec.hosts.items():
        networks = context.networks_of[name]
        if host.via is None or not networks or not context.networks_of[host.via]:
            continue
        if not context.meet(name, host.via):
            yield Diagnostic(
                "NET015",
                f"the jump host `{host.via}` shares no network with `{name}`",
                context.span("hosts", name, "via"),
                label="no wlan or ethernet has both hosts",
                notes=(Note(context.span("hosts", host.via, key=True), "the jump host"),),
                help=(f"choose a host on `{networks[0][1].name}`, or add `{host.via}` to its hosts",),
            )
