"""Each host has an address at which the others, and their ROS nodes, can reach it."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Note, Severity
from swarmctl.topology.address import Kind, Scheme, Subnet, kind, means_self, normal, scheme, smallest_subnet

_LARGEST = 8  # bits that the addresses of the largest private network have in common (RFC 1918)
_UNFIT = (Kind.IPV6, Kind.UNSPECIFIED, Kind.GROUP, Kind.RESERVED)


def loopback_addresses(case: Case) -> Iterator[Diagnostic]:
    """NET002: an address that means another computer on each computer, in a swarm of several."""
    hosts = case.spec.hosts
    if len(hosts) == 1:
        return
    for name, ip in case.addresses.items():
        if means_self(hosts[name].address) if ip is None else kind(ip) is Kind.LOOPBACK:
            yield Diagnostic(
                "NET002",
                f"`{hosts[name].address}` is every computer's own address; "
                f"no other host reaches `{name}` there",
                case.span("hosts", name, "address"),
                label="a loopback address",
                help=("give the address that the host has on the swarm's network",),
            )


def unfit_addresses(case: Case) -> Iterator[Diagnostic]:
    """NET003, NET011: an address that no ROS 1 node can be reached at, or that changes with each boot."""
    for name, ip in case.addresses.items():
        if ip is None or (what := kind(ip)) is Kind.ORDINARY:
            continue
        if what in _UNFIT:
            yield Diagnostic(
                "NET003",
                f"host `{name}` cannot have the address `{ip}`",
                case.span("hosts", name, "address"),
                label=what.value,
                help=("give its IPv4 address",),
            )
        elif what is Kind.LINK_LOCAL:
            yield Diagnostic(
                "NET011",
                f"host `{name}` found no DHCP server when it had the address `{ip}`",
                case.span("hosts", name, "address"),
                severity=Severity.WARNING,
                label="chosen at random, anew after a conflict",
                help=("give the host a fixed address outside 169.254.0.0/16",),
            )


def naming_schemes(case: Case) -> Iterator[Diagnostic]:
    """NET004: some hosts are called by IP address, others by name; not every host resolves every name."""
    schemes: dict[Scheme, list[str]] = {}
    for name, ip in case.addresses.items():
        given = case.spec.hosts[name].address
        if name not in case.passages and (ip is not None or not means_self(given)):
            schemes.setdefault(Scheme.IP if ip is not None else scheme(given), []).append(name)
    if len(schemes) < 2:
        return
    usual = max(schemes, key=lambda one: (len(schemes[one]), one is Scheme.IP))
    kept = {*schemes[usual], *case.passages}
    strays = [name for name in case.spec.hosts if name not in kept]
    more = f" and {len(strays) - 1} more" if len(strays) > 1 else ""
    yield Diagnostic(
        "NET004",
        f"host `{strays[0]}`{more} is found by {scheme(case.spec.hosts[strays[0]].address).value}, "
        f"the other {len(schemes[usual])} by {usual.value}",
        case.span("hosts", strays[0], "address"),
        severity=Severity.WARNING,
        label="must mean the same on every host",
        notes=(Note(case.span("hosts", schemes[usual][0], "address"), usual.value),),
        help=("give every host its IPv4 address; swarmctl then writes the names into /etc/hosts",),
    )


def borrowed_names(case: Case) -> Iterator[Diagnostic]:
    """NET016: the address is the name of another host, and /etc/hosts says so on every host."""
    hosts = case.spec.hosts
    for name, ip in case.addresses.items():
        if ip is None and (other := normal(hosts[name].address)) in hosts and other != name:
            yield Diagnostic(
                "NET016",
                f"the address of host `{name}` is the name of host `{other}`",
                case.span("hosts", name, "address"),
                label=f"leads to `{other}`",
                notes=(Note(case.span("hosts", other, key=True), "the host of that name"),),
                help=(f"give the address of `{name}` itself",),
            )


def unlisted_hosts(case: Case) -> Iterator[Diagnostic]:
    """NET017: nodes are to go by the host's name, and /etc/hosts cannot say where that is."""
    if case.spec.ros.naming != "hosts":
        return
    for name, ip in case.addresses.items():
        given = case.spec.hosts[name].address
        if ip is None and name not in case.passages and normal(given) != name:
            yield Diagnostic(
                "NET017",
                f"the nodes of host `{name}` are to call it `{name}`, and no other host learns where that is",
                case.span("hosts", name, "address"),
                label="a name, which /etc/hosts cannot list",
                notes=(Note(case.span("ros", "naming"), "hosts go by their names here"),),
                help=(
                    "give its IPv4 address; swarmctl then writes the name into every /etc/hosts",
                    f"or, if the hosts resolve `{given}`, leave `naming: address`",
                ),
            )


def addresses_in_subnets(case: Case) -> Iterator[Diagnostic]:
    """NET005, NET010: an address belongs to a host of a network that the host is on."""
    for name, networks in case.networks_of.items():
        ip = case.addresses[name]
        subnets = [case.subnets[index] for index, _ in networks]
        if ip is None or not subnets or kind(ip) in _UNFIT:
            continue
        home = next((one for one in subnets if one is not None and ip in one), None)
        if home is None and None not in subnets:
            index, link = networks[0]
            where = f"`{link.name}` ({subnets[0]})" if len(networks) == 1 else "any of its networks"
            key = ("subnet",) if link.subnet else ("name",)
            yield Diagnostic(
                "NET005",
                f"the address `{ip}` of host `{name}` is not in {where}",
                case.span("hosts", name, "address"),
                label="the other hosts cannot send there",
                notes=(Note(case.span("links", index, *key), f"has the addresses {subnets[0]}"),),
                help=("correct the address, or the `subnet` of the network",),
            )
        elif home is not None and home.num_addresses > 2 and ip in (home[0], home[-1]):
            what = "name of the subnet" if ip == home[0] else "broadcast address of"
            yield Diagnostic(
                "NET010",
                f"host `{name}` cannot have the address `{ip}`, the {what} {home}",
                case.span("hosts", name, "address"),
                label="no host's address",
                help=(f"choose one between {home[1]} and {home[-2]}, or give the network's `subnet`",),
            )


def split_networks(case: Case) -> Iterator[Diagnostic]:
    """NET007: the hosts of one network lie in different /24s, and no subnet joins them."""
    for index, link in case.networks:
        if link.subnet is not None or case.subnets[index] is not None:
            continue
        ips = {name: ip for name in case.witnesses[index] if (ip := case.addresses[name]) is not None}
        ordinary = {name: ip for name, ip in ips.items() if kind(ip) is Kind.ORDINARY}
        if len(ordinary) < 2:
            continue
        first = next(iter(ordinary))
        other = next((one for one in ordinary if int(ordinary[one]) >> 8 != int(ordinary[first]) >> 8), None)
        if other is None:
            continue
        yield Diagnostic(
            "NET007",
            f"`{ordinary[first]}` of host `{first}` and `{ordinary[other]}` of host `{other}` "
            f"reach each other on `{link.name}` only through a router",
            case.span("hosts", other, "address"),
            severity=Severity.WARNING,
            label="in another /24",
            notes=(
                Note(case.span("hosts", first, "address"), "this host is on the same network"),
                Note(case.span("links", index, "name"), "this network"),
            ),
            help=_one_or_two(smallest_subnet(ordinary.values())),
        )


def _one_or_two(subnet: Subnet) -> tuple[str, ...]:
    """How to mend a split network; nobody has one of a /7, the private 10.0.0.0/8 being the largest."""
    if subnet.prefixlen < _LARGEST:
        return ("correct the address that is not of this network, or describe two networks",)
    return (f"if the network is larger, say so: subnet: {subnet}", "if an address is misspelt, correct it")


RULES: tuple[Rule, ...] = (
    loopback_addresses,
    unfit_addresses,
    naming_schemes,
    borrowed_names,
    unlisted_hosts,
    addresses_in_subnets,
    split_networks,
)
