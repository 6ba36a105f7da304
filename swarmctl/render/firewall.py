"""The firewall of a host of a filtered island: a table of nftables, from the flows of the graph. Pure.

It lets others reach a service of ROS only where a flow has them, and of the host's accounts only those that
run units. What is no service of ROS passes, and SSH before everything else. Source: nft(8).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from swarm_onboard.ros2_probe import observe

from swarmctl.render import shipped_files
from swarmctl.render.bundle import File, Part, Unit
from swarmctl.render.middleware import middleware_of
from swarmctl.render.multimaster import provider_of
from swarmctl.render.quoting import render
from swarmctl.render.security_level import SecurityLevel
from swarmctl.render.service_values import groups, robots_with_nodes, service_values, toward_robots
from swarmctl.swarm import names
from swarmctl.swarm.addresses import OWN_NAME, ip_of
from swarmctl.swarm.flow import Service
from swarmctl.swarm.ports import DRAWN, PortRange
from swarmctl.swarm.resolved import Host, Island, Swarm

_LOADER = "bin/load-firewall"
_MOST = {Service.NODES: 1024}  # TCP connections of one host at a time: a recorder has one for each topic
_MOST_CALLS = 256


@dataclass(frozen=True)
class _Rule:
    """Who may exchange packets at which ports, addresses by `ip` and `ip6`.

    ``most``: TCP connections of each; ``own``: on the host itself, at whichever address.
    """

    what: str
    protocol: str
    ports: str  # as nft writes them; the loader defines `ephemeral`
    addresses: Mapping[str, Sequence[str]]
    most: int = 0
    own: bool = False


class Filtered(SecurityLevel):
    """The level `filtered`: on each host a firewall, and lists of addresses in its units."""

    filters = True

    def parts(self, swarm: Swarm, host: Host) -> Iterator[Part]:
        """Yields the table of nftables, and the unit that loads it."""
        yield _part(swarm, host)

    def reachable(self, swarm: Swarm, host: Host) -> tuple[str, ...]:
        """Returns the addresses of the other hosts in the flows of ``host``.

        A node reaches others of its host by the host's own address, and discovers by multicast in a group.
        """
        island = swarm.island_of(host.name)
        peers = swarm.peers.get(host.name, frozenset())
        addresses = (one.ros_address for name, one in swarm.hosts.items() if name in peers)
        return (
            "localhost",
            host.ros_address,
            *addresses,
            *robots_with_nodes(swarm, island),
            *toward_robots(swarm, host),
            *groups(swarm, island),
        )

    def port_owner(self, host: Host) -> str:
        """Returns the account of the units: what another one has is no port of ROS."""
        return host.user


FILTERED: SecurityLevel = Filtered()


def _part(swarm: Swarm, host: Host) -> Part:
    island = swarm.island_of(host.name)
    table = render(
        "firewall.nft",
        table=names.firewall_table(swarm.name),
        ssh=host.port,
        overlay=swarm.overlay,
        interface=names.wireguard_interface(swarm.name),
        accounts=tuple(dict.fromkeys(("root", host.user, *_lookers(island)))),
        offered=list(_offered(swarm, host, island)),
        answered=list(_answered(swarm, host, island)),
        used=list(_used(swarm, host)),
    )
    name = names.unit(swarm.name, names.FIREWALL)
    text = render(
        "firewall.service",
        **service_values(swarm, host),
        table=names.firewall_table(swarm.name),
        file=names.FIREWALL_FILE,
        runtime=names.runtime_folder(swarm.name, names.FIREWALL),
    )
    files = (
        File(names.FIREWALL_FILE, table, origin="security"),
        File(f"units/{name}", text, origin="security"),
        File(_LOADER, shipped_files.text("os/load-firewall"), 0o755),
    )
    return Part(files, (Unit(name, tuple(file.path for file in files)),), requires={"nft": ("security",)})


def _lookers(island: Island) -> Iterator[str]:
    """The account under which `status` looks at a graph without a master: by a node on each host."""
    if not island.has_master:
        yield str(observe.ACCOUNT)


def _offered(swarm: Swarm, host: Host, island: Island) -> Iterator[_Rule]:
    """What others may reach on ``host``."""
    for service, ports in _services(swarm, host, island):
        sources = {
            source
            for flow in swarm.flows
            if flow.service is service and host.name in flow.hosts
            for source in flow.sources
            if source != host.name
        }
        addresses = [one.ros_address for one in swarm.hosts.values() if one.name in sources]
        if service is Service.NODES:
            addresses += robots_with_nodes(swarm, island)
            if island.discovery.method == "multicast":
                addresses.append(host.ros_address)  # what it sends to a group comes back from the network
        for one in ports:
            most = _MOST.get(service, _MOST_CALLS) if one.protocol == "tcp" else 0
            yield _rule(service, one, addresses, most=most)


def _answered(swarm: Swarm, host: Host, island: Island) -> Iterator[_Rule]:
    """What units of ``host`` answer at, and nobody else: at whichever address.

    At ports of the range that Linux draws from only where nodes are reached: others use it on loopback.
    """
    for service, ports in _services(swarm, host, island):
        for one in ports:
            yield _rule(service, one, _node_addresses(host) if one == DRAWN else ())


def _node_addresses(host: Host) -> Iterator[str]:
    """Where nodes of ROS 1 are reached; Debian gives a host's own name an address of its own there."""
    yield host.ros_address
    if ip_of(host.advertised) is None:
        yield OWN_NAME


def _used(swarm: Swarm, host: Host) -> Iterator[_Rule]:
    """What units of ``host`` reach, and other accounts do not: on the host itself, and on others.

    Other accounts have programs of their own that listen on the loopback interface at ports of the range
    that Linux draws from: nodes of ROS 1 are shut to them at the host's address only.
    """
    found: dict[tuple[Service, PortRange], dict[str, None]] = {}
    own = set()
    reached = {(flow.service, to) for flow in swarm.flows if host.name in flow.sources for to in flow.hosts}
    for island in swarm.islands:
        for name in island.hosts:
            other = swarm.hosts[name]
            for service, ports in _services(swarm, other, island):
                for one in ports if other is host or (service, name) in reached else ():
                    addresses = found.setdefault((service, one), {})
                    if other is host and one != DRAWN:
                        own.add((service, one))
                    else:
                        addresses[other.ros_address] = None
                    if one.protocol == "udp":
                        addresses.update(dict.fromkeys(groups(swarm, island)))
    for (service, one), addresses in found.items():
        yield _rule(service, one, addresses, own=(service, one) in own)


def _services(swarm: Swarm, host: Host, island: Island) -> Iterator[tuple[Service, Sequence[PortRange]]]:
    """What ``host`` listens on for others: only the hub of its ``island`` has a master and a multimaster."""
    is_hub = host.name == island.hub
    for service, ports in middleware_of(island.distro).ports(island).items():
        if is_hub or service is not Service.MASTER:
            yield service, ports
    if is_hub and len(swarm.islands) > 1:
        yield Service.MULTIMASTER, provider_of(swarm.multimaster, island.distro).ports(swarm, island)


def _rule(
    service: Service, ports: PortRange, addresses: Iterable[str], *, most: int = 0, own: bool = False
) -> _Rule:
    found: dict[str, list[str]] = {}
    for one in addresses:
        ip = ip_of(one)
        if ip is not None:
            found.setdefault("ip" if ip.version == 4 else "ip6", []).append(one)
    first, last = ports.first, ports.last
    text = "$ephemeral" if ports == DRAWN else f"{first}-{last}" if last > first else f"{first}"
    return _Rule(service.value, ports.protocol, text, found, most, own)
