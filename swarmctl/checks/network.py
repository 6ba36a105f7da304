"""Hosts that must talk to each other share a network, and their addresses lie on it."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Fix, Note, Severity
from swarmctl.spec.edits import append_item, mend
from swarmctl.spec.model import Wlan
from swarmctl.topology.address import Subnet


def paths_to_hub(case: Case) -> Iterator[Diagnostic]:
    """NET001: every host of an island shares a network with the island's hub."""
    for island in case.islands:
        for name in island.hosts:
            if not case.meet(name, island.hub):
                yield Diagnostic(
                    "NET001",
                    f"host `{name}` cannot reach its hub `{island.hub}`",
                    case.span("hosts", name, key=True),
                    label="no wlan or ethernet joins the two",
                    help=(_network_help(case, name, island.hub),),
                    fix=_network_fix(case, name, island.hub),
                )


def _network_help(case: Case, name: str, hub: str) -> str:
    if case.networks_of[hub]:
        return f"add `{name}` to the hosts of `{case.networks_of[hub][0][1].name}`"
    return f"add to `links`: {{kind: wlan, name: lab, hosts: [{hub}, {name}]}}"


def _network_fix(case: Case, name: str, hub: str) -> Fix | None:
    """The host added to its hub's network, if there is one only and the host's address fits there."""
    if len(case.networks_of[hub]) != 1:
        return None
    [(index, link)] = case.networks_of[hub]
    ip, subnet = case.addresses[name], case.subnets[index]
    if ip is not None and subnet is not None and ip not in subnet:
        return None
    edits = append_item(case.source, ("links", index, "hosts"), name)
    return mend(f"add `{name}` to the hosts of `{link.name}`", edits)


def hosts_alone(case: Case) -> Iterator[Diagnostic]:
    """NET014: a host on no network, in a swarm of several; of those in an island NET001 tells."""
    if len(case.spec.hosts) == 1:
        return
    for name, networks in case.networks_of.items():
        home = case.home.get(name)
        if not networks and name not in case.passages and (home is None or len(home.hosts) == 1):
            yield Diagnostic(
                "NET014",
                f"host `{name}` is on no network",
                case.span("hosts", name, key=True),
                severity=Severity.WARNING,
                label="no wlan or ethernet names it",
                help=("add it to the hosts of a network, or add a network to `links`",),
            )


def addresses_towards_hubs(case: Case) -> Iterator[Diagnostic]:
    """NET006: a host on several networks has one ROS address; it must be on the one that leads to its hub."""
    for island in case.islands:
        strangers: dict[tuple[str, int], list[str]] = {}
        for name in island.hosts:
            if name == island.hub or len(case.networks_of[name]) + len(case.networks_of[island.hub]) < 3:
                continue
            joining = [index for index, link in case.networks_of[name] if island.hub in case.members[index]]
            for one, peer in ((name, island.hub), (island.hub, name)):
                if joining and _is_elsewhere(case, one, joining):
                    strangers.setdefault((one, joining[0]), []).append(peer)
        for (name, index), peers in strangers.items():
            more = f" and {len(peers) - 1} more" if len(peers) > 1 else ""
            yield Diagnostic(
                "NET006",
                f"`{name}` meets `{peers[0]}`{more} on `{case.network_at[index].name}`, "
                f"but its address is on another network",
                case.span("hosts", name, "address"),
                label="its nodes tell everyone this address",
                notes=(Note(case.span("links", index, "name"), "the network that joins them"),),
                help=(f"give the address that `{name}` has on that network, or put both on one network",),
            )


def _is_elsewhere(case: Case, host: str, joining: list[int]) -> bool:
    """Whether the address of ``host`` is on one of its networks, but on none of ``joining``."""
    ip = case.addresses[host]
    homes = [
        index
        for index, _ in case.networks_of[host]
        if ip is not None and (subnet := case.subnets[index]) is not None and ip in subnet
    ]
    return bool(homes) and not any(index in joining or case.subnets[index] is None for index in homes)


def unclear_names(case: Case) -> Iterator[Diagnostic]:
    """NET012: a host on several networks is called by a name, which may mean either of its addresses."""
    for name, networks in case.networks_of.items():
        if len(networks) > 1 and case.addresses[name] is None and name in case.home:
            yield Diagnostic(
                "NET012",
                f"host `{name}` is on {len(networks)} networks, and its name means an address on any of them",
                case.span("hosts", name, "address"),
                severity=Severity.WARNING,
                label="a name, not an address",
                notes=tuple(
                    Note(case.span("links", index, "name"), "one network") for index, _ in networks[:2]
                ),
                help=("give the IPv4 address that it has on the network of its hub",),
            )


def overlapping_networks(case: Case) -> Iterator[Diagnostic]:
    """NET008, NET009: two networks have addresses in common; a host on both cannot tell where to send."""
    known = [(subnet, index) for index, subnet in case.subnets.items() if subnet is not None]
    ordered = sorted(known, key=lambda one: (one[0].version, one[0], one[1]))
    widest: list[tuple[Subnet, int]] = []  # those that hold the next one, if any does
    for subnet, index in ordered:
        while widest and not (widest[-1][0].version == subnet.version and widest[-1][0].overlaps(subnet)):
            widest.pop()
        for _, earlier in widest:
            if case.network_at[earlier].name != case.network_at[index].name:  # else ID004 tells
                yield _overlap(case, *sorted((earlier, index)))
        widest.append((subnet, index))


def _overlap(case: Case, first: int, second: int) -> Diagnostic:
    one, other = case.network_at[first], case.network_at[second]
    shared = case.members[first] & case.members[second]
    both = next((host for host in other.hosts if host in shared), None)
    named = [f"`{link.name}` ({case.subnets[index]})" for index, link in ((first, one), (second, other))]
    fact = f"networks {' and '.join(named)} overlap"
    return Diagnostic(
        "NET009" if both is None else "NET008",
        fact if both is None else f"{fact}; host `{both}` cannot tell over which to send",
        case.span("links", second, "subnet" if other.subnet else "name"),
        severity=Severity.WARNING if both is None else Severity.ERROR,
        label="the same addresses" if both is None else f"`{both}` is on both",
        notes=(Note(case.span("links", first, "subnet" if one.subnet else "name"), "the other network"),),
        help=(
            "if an access point joins the two, they are one network: put all hosts into one link",
            "else give each network a `subnet` of its own",
        ),
    )


def isolated_clients(case: Case) -> Iterator[Diagnostic]:
    """NET013: hosts that must talk meet only on a wlan whose access point keeps its clients apart."""
    isolated = {
        index for index, link in case.networks if isinstance(link, Wlan) and link.client_isolation is True
    }
    if not isolated:
        return
    apart: dict[int, list[tuple[str, str]]] = {}
    for name, peer in dict.fromkeys(_talking(case)):
        joining = [index for index, _ in case.networks_of[name] if peer in case.members[index]]
        if joining and isolated.issuperset(joining):
            apart.setdefault(joining[0], []).append((name, peer))
    for index, pairs in apart.items():
        (name, peer), more = pairs[0], len(pairs) - 1
        yield Diagnostic(
            "NET013",
            f"`{name}` and `{peer}`{f' (and {more} more)' if more else ''} must talk over "
            f"`{case.network_at[index].name}`, which keeps its clients apart",
            case.span("links", index, "client_isolation"),
            label="no packet passes between two clients",
            help=("turn client isolation off at the access point, or join the hosts by another network",),
        )


def _talking(case: Case) -> Iterator[tuple[str, str]]:
    """Pairs of hosts that cannot do without each other: member and hub, and hubs with a bridge between."""
    hubs = {island.name: island.hub for island in case.islands}
    for island in case.islands:
        yield from ((name, island.hub) for name in island.hosts if name != island.hub)
    for bridge in case.bridges:
        yield from ((hubs[bridge.origin], hubs[to]) for to in bridge.to if to in hubs)


def jumps(case: Case) -> Iterator[Diagnostic]:
    """NET015: the host to jump through shares no network with the host behind it."""
    for name, host in case.spec.hosts.items():
        networks = case.networks_of[name]
        if host.via is None or not networks or not case.networks_of[host.via]:
            continue
        if not any(host.via in case.members[index] for index, _ in networks):
            yield Diagnostic(
                "NET015",
                f"`{host.via}` shares no network with `{name}`, and cannot be the way to it",
                case.span("hosts", name, "via"),
                severity=Severity.WARNING,
                label="no wlan or ethernet joins the two",
                notes=(Note(case.span("hosts", host.via, key=True), "the host to jump through"),),
                help=(f"name a host that is on `{networks[0][1].name}`, or add `{host.via}` to its hosts",),
            )


RULES: tuple[Rule, ...] = (
    paths_to_hub,
    hosts_alone,
    addresses_towards_hubs,
    unclear_names,
    overlapping_networks,
    isolated_clients,
    jumps,
)
