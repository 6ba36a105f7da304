"""The address of each host: reachable by the other hosts and their ROS nodes."""

from __future__ import annotations

from collections.abc import Iterator
from ipaddress import ip_address

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.linter.context import RuleContext, rule
from swarmctl.rules.identity import Claim, duplicates
from swarmctl.swarm.addresses import (
    Ip,
    Kind,
    Scheme,
    Subnet,
    ip_of,
    is_ipv6,
    kind,
    means_self,
    normal,
    ros_address,
    scheme,
    smallest_subnet,
)
from swarmctl.swarm.ports import ssh_port
from swarmctl.swarm.resolved import Island
from swarmctl.yamltext.source import Loc

_LARGEST = 8  # bits that the addresses of the largest private network have in common (RFC 1918)
_UNFIT = (Kind.UNSPECIFIED, Kind.GROUP, Kind.RESERVED)
_NAMED = "or give it a name as `address`, and write `ros: {ipv6: true}`"
_OWN_IPV6 = "write its own IPv6 address (2000::/3 or fd00::/8)"
_BY_NAME = (
    "write a name that every host resolves to its IPv6 address",
    f"or {_OWN_IPV6} and `ros: {{naming: hosts}}`",
)


@rule("NET002")
def loopback_addresses(context: RuleContext) -> Iterator[Diagnostic]:
    """A loopback address in a swarm of several hosts."""
    hosts = context.spec.hosts
    if len(hosts) == 1:
        return
    for name, ip in context.addresses.items():
        if means_self(hosts[name].address) if ip is None else kind(ip) is Kind.LOOPBACK:
            yield Diagnostic(
                "NET002",
                f"`{hosts[name].address}` is the local address of every computer; "
                f"no other host reaches `{name}` with it",
                context.span("hosts", name, "address"),
                label="a loopback address",
                help=("write the address that the host has on the swarm's network",),
            )


@rule("NET003", "NET011", by_distro=True)
def unsuitable_addresses(context: RuleContext) -> Iterator[Diagnostic]:
    """An address at which no ROS 1 node is reachable, or that may change at each boot."""
    masters, ros = context.has_masters, context.spec.ros
    for name, ip in context.addresses.items():
        if ip is None:
            continue
        what = kind(ip)
        if masters and ros.ipv6 and name not in context.jump_hosts:
            if not (ros.naming == "hosts" and ip.version == 6 and _is_own(ip)):
                yield Diagnostic(
                    "NET003",
                    f"host `{name}` cannot have the address `{ip}` with `ipv6: true`",
                    context.span("hosts", name, "address"),
                    label="nodes reach each other over IPv6 by names",
                    notes=(Note(context.span("ros", "ipv6"), "ROS_IPV6=on"),),
                    help=_BY_NAME,
                )
        elif what in _UNFIT or (what is Kind.IPV6 and masters):
            yield Diagnostic(
                "NET003",
                f"host `{name}` cannot have the address `{ip}`",
                context.span("hosts", name, "address"),
                label=what.value,
                help=("write its IPv4 address", *((_NAMED,) if what is Kind.IPV6 else ())),
            )
        elif what is Kind.LINK_LOCAL:
            yield Diagnostic(
                "NET011",
                f"the address `{ip}` of host `{name}` is link-local: no DHCP server answered",
                context.span("hosts", name, "address"),
                label="random, changes after a conflict",
                help=("give the host a fixed address outside 169.254.0.0/16",),
            )


@rule("NET003", needs="domains")
def unsuitable_ipv6(context: RuleContext) -> Iterator[Diagnostic]:
    """An IPv6 address at which others cannot reach nodes of ROS 2, or their server."""
    for island in context.islands:
        found = [name for name in island.hosts if is_ipv6(ros_address(context.spec, name))]
        if not found or island.discovery.method == "local":
            continue
        strange = [name for name in found if not _is_own(ip_address(context.spec.hosts[name].address))]
        name, cause = found[0], _ipv4_beside(context, island, found)
        if strange:
            name, cause = strange[0], ("a loopback, link-local or multicast address", None, _OWN_IPV6)
        if cause is not None:
            label, note, other = cause
            yield Diagnostic(
                "NET003",
                f"host `{name}` cannot have the address `{context.spec.hosts[name].address}`",
                context.span("hosts", name, "address"),
                label=label,
                notes=(note,) if note is not None else (),
                help=("write the IPv4 address of every host", *((f"or {other}",) if other else ())),
            )


def _ipv4_beside(
    context: RuleContext, island: Island, found: list[str]
) -> tuple[str, Note | None, str] | None:
    """What of DDS uses IPv4 only, beside hosts of IPv6: as a label, a note and what else to write."""
    if island.discovery.rmw == "zenoh":
        return None
    hosts = [name for one in context.islands for name in one.hosts]
    other = next((name for name in hosts if not is_ipv6(context.spec.hosts[name].address)), None)
    if other is not None:
        note = Note(context.span("hosts", other, "address"), "no IPv6 address")
        return "nodes of DDS use IPv6 here", note, "write the IPv6 address of every host"
    peers = (name for name, driver in context.ros_drivers.items() if driver.peer)
    robot = next((name for name in peers if context.driving[name] in found), None)
    if robot is not None:
        note = Note(context.span("robots", robot, key=True), "runs nodes itself")
        return "DDS on the robot uses IPv4", note, ""
    if island.discovery.method == "server" and "ipv6-servers" not in context.middleware.capabilities:
        return (
            f"the discovery server of `{island.distro}` uses IPv4 only",
            None,
            "write `discovery: peers`, without `servers`",
        )
    return None


def wanted_version(context: RuleContext) -> str:
    """Returns the IP version over which the nodes of the swarm reach each other."""
    return "IPv6" if context.spec.ros.ipv6 else "IPv4"


def _is_own(ip: Ip) -> bool:
    """True of a global or unique local address: one that other hosts can reach."""
    return not (ip.is_loopback or ip.is_link_local or ip.is_multicast or ip.is_unspecified)


@rule("NET004")
def naming_schemes(context: RuleContext) -> Iterator[Diagnostic]:
    """Some hosts have an IP address, others a name that not every host may resolve."""
    schemes: dict[Scheme, list[str]] = {}
    for name, ip in context.addresses.items():
        given = context.spec.hosts[name].address
        if name not in context.jump_hosts and (ip is not None or not means_self(given)):
            schemes.setdefault(Scheme.IP if ip is not None else scheme(given), []).append(name)
    if len(schemes) < 2:
        return
    usual = max(schemes, key=lambda one: (len(schemes[one]), one is Scheme.IP))
    kept = {*schemes[usual], *context.jump_hosts}
    strays = [name for name in context.spec.hosts if name not in kept]
    more = f" and {len(strays) - 1} more" if len(strays) > 1 else ""
    need = wanted_version(context)
    yield Diagnostic(
        "NET004",
        f"host `{strays[0]}`{more} is addressed by {scheme(context.spec.hosts[strays[0]].address).value}, "
        f"the other {len(schemes[usual])} by {usual.value}",
        context.span("hosts", strays[0], "address"),
        label="every host must resolve it",
        notes=(Note(context.span("hosts", schemes[usual][0], "address"), usual.value),),
        help=(f"write the {need} address of every host; swarmctl then writes the names into /etc/hosts",),
    )


@rule("NET016")
def borrowed_names(context: RuleContext) -> Iterator[Diagnostic]:
    """An address that is the name of another host, as /etc/hosts maps it on every host."""
    hosts = context.spec.hosts
    for name, ip in context.addresses.items():
        if ip is None and (other := normal(hosts[name].address)) in hosts and other != name:
            yield Diagnostic(
                "NET016",
                f"the address of host `{name}` is the name of host `{other}`",
                context.span("hosts", name, "address"),
                label=f"resolves to `{other}`",
                notes=(Note(context.span("hosts", other, key=True), "the other host"),),
                help=(f"write the address of `{name}` itself",),
            )


@rule("NET017", by_distro=True)
def unlisted_hosts(context: RuleContext) -> Iterator[Diagnostic]:
    """`naming: hosts` with a host that has no IP address for /etc/hosts."""
    need = wanted_version(context)
    if context.spec.ros.naming != "hosts" or "naming" not in context.middleware.settings:
        return
    for name, ip in context.addresses.items():
        given = context.spec.hosts[name].address
        if ip is None and name not in context.jump_hosts and normal(given) != name:
            yield Diagnostic(
                "NET017",
                f"`naming: hosts` needs an {need} `address` for `{name}`",
                context.span("hosts", name, "address"),
                label="a name, not an IP address",
                notes=(Note(context.span("ros", "naming"), "nodes advertise host names"),),
                help=(
                    f"write its {need} address; swarmctl then writes it with the name into every /etc/hosts",
                    f"or, if all hosts resolve `{given}`, write `naming: address`",
                ),
            )


@rule("NET005", "NET010")
def addresses_in_subnets(context: RuleContext) -> Iterator[Diagnostic]:
    """An address outside the host's networks, or the first or last of its subnet."""
    for name, networks in context.networks_of.items():
        ip = context.addresses[name]
        subnets = [context.subnets[index] for index, _ in networks]
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
                context.span("hosts", name, "address"),
                label="not reachable by the other hosts",
                notes=(Note(context.span("links", index, *key), f"its subnet is {subnets[0]}"),),
                help=("correct the address, or the `subnet` of the network",),
            )
        elif home is not None:
            yield from _first_or_last(context, ip, home, f"host `{name}`", ("hosts", name))
    for number, ends in context.ip_links.items():
        ip = ip_of(ends.link.address)
        for index, link in context.networks_of[ends.link.host]:
            subnet = context.subnets[index]
            if link is ends.network and ip is not None and subnet is not None:
                yield from _first_or_last(
                    context, ip, subnet, f"robot `{ends.link.robot}`", ("links", number)
                )


def _first_or_last(context: RuleContext, ip: Ip, home: Subnet, who: str, loc: Loc) -> Iterator[Diagnostic]:
    if home.num_addresses > 2 and ip in (home[0], home[-1]):
        what = "network address of" if ip == home[0] else "broadcast address of"
        yield Diagnostic(
            "NET010",
            f"{who} cannot have the address `{ip}`, the {what} {home}",
            context.span(*loc, "address"),
            label="no interface can have it",
            help=(f"choose one between {home[1]} and {home[-2]}, or set the network's `subnet`",),
        )


@rule("NET007")
def split_networks(context: RuleContext) -> Iterator[Diagnostic]:
    """Hosts of one network in different /24 subnets, without a `subnet`."""
    for index, link in context.networks:
        if link.subnet is not None or context.subnets[index] is not None:
            continue
        ips = {
            name: ip for name in context.subnet_sources[index] if (ip := context.addresses[name]) is not None
        }
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
            context.span("hosts", other, "address"),
            label="another /24 subnet",
            notes=(
                Note(context.span("hosts", first, "address"), "another host of this network"),
                Note(context.span("links", index, "name"), "the network"),
            ),
            help=_one_or_two(smallest_subnet(ordinary.values())),
        )


def _one_or_two(subnet: Subnet) -> tuple[str, ...]:
    """Returns the help for a split network; the largest private network is 10.0.0.0/8."""
    if subnet.prefixlen < _LARGEST:
        return ("correct the wrong address, or write two networks",)
    return (f"if the network is larger, write `subnet: {subnet}`", "otherwise correct the wrong address")


@rule("ID001")
def duplicate_addresses(context: RuleContext) -> Iterator[Diagnostic]:
    """Two hosts with one address."""
    hosts = context.spec.hosts
    claims: list[Claim] = [
        ((normal(host.address), ssh_port(context.spec, name)), f"host `{name}`", ("hosts", name, "address"))
        for name, host in hosts.items()
    ]
    yield from duplicates(context, "ID001", "address", claims, "give each host its own address")
