"""The parameters of the guard of a ROS master: which host may call, and who owns what. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from swarmctl.render import expected_nodes, shipped_files
from swarmctl.render.bundle import File
from swarmctl.render.yaml_params import params_file
from swarmctl.swarm import names
from swarmctl.swarm.addresses import OWN_NAME, ip_of
from swarmctl.swarm.flow import Service
from swarmctl.swarm.resolved import Host, Island, Swarm
from swarmctl.swarm.topics import DIAGNOSTICS

_PATH = "guard/config.yaml"  # beside its program
#: On these, nodes publish that no spec declares.
_SHARED = ("/tf", "/tf_static", "/rosout", DIAGNOSTICS)

_Owned = Iterator[tuple[str, Iterable[str]]]


@dataclass(frozen=True)
class Guard:
    """The guard of a master: its program, what this reads, the path of that, and where it listens."""

    program: tuple[File, ...] = ()
    read: tuple[File, ...] = ()
    path: str = ""
    places: Sequence[str] = ()


def guard_of(swarm: Swarm, island: Island) -> Guard:
    """Returns the guard of the master of ``island``; an empty one if its level of security has no filter."""
    if not island.filtered:
        return Guard()
    file = File(_PATH, params_file(parameters(swarm, island)), origin="security")
    return Guard(shipped_files.folder("guard"), (file,), _PATH, places(swarm.hosts[island.hub]))


def places(hub: Host) -> list[str]:
    """Returns the addresses at which the guard listens: where nodes look for it, and on loopback."""
    if ":" in hub.ros_address:
        return list(dict.fromkeys((hub.ros_address, "::1")))
    named = [] if ip_of(hub.advertised) else [OWN_NAME]
    return list(dict.fromkeys((hub.ros_address, "127.0.0.1", *named)))


def parameters(swarm: Swarm, island: Island) -> dict[str, Any]:
    """Returns what the guard of the master of ``island`` reads."""
    hub = swarm.hosts[island.hub]
    others = {
        source: swarm.island_of(source)
        for flow in swarm.flows
        if flow.service is Service.MASTER and island.hub in flow.hosts
        for source in flow.sources
        if source not in island.hosts
    }
    joined = (one for one in swarm.islands if one.name in swarm.received.get(island.name, {}))
    return {
        "hub": island.hub,
        "places": places(hub),
        "port": island.master_port,
        "uri": swarm.master_uri(island),
        "use_sim_time": swarm.use_sim_time,
        "hosts": {name: _at(swarm, name) for name in island.hosts},
        "others": {
            source: {
                "at": _at(swarm, source),
                "receives": _crossing(swarm, island, other),
                "sends": [] if other.has_master else _crossing(swarm, other, island),
            }
            for source, other in others.items()
        },
        "joined": [text for one in joined for text in swarm.uri_hosts_of(one)],
        "names": _seen_by(swarm, island, _names(swarm, island)),
        "topics": _seen_by(swarm, island, (one for one in _topics(swarm) if one[0] not in _SHARED)),
    }


def _crossing(swarm: Swarm, origin: Island, to: Island) -> list[str]:
    return list(swarm.received.get(to.name, {}).get(origin.name, {}))


def _at(swarm: Swarm, host: str) -> list[str]:
    """The address and the name of a host, and the addresses of its robots that run nodes."""
    one = swarm.hosts[host]
    robots = (robot.node_address for robot in swarm.robots_on(host) if robot.node_address)
    return list(dict.fromkeys((one.ros_address, one.advertised, host, *robots)))


def _names(swarm: Swarm, island: Island) -> _Owned:
    """Nodes and namespaces, each with hosts on which they run."""
    yield "/rosout", [island.hub]
    spaces = {robot.namespace for robot in swarm.robots.values()}
    for robot in swarm.robots.values():
        yield robot.namespace, [robot.host]
        if expected_nodes.driver(swarm, robot).node:
            yield robot.driver_node, [robot.host]
        if robot.gated:
            yield robot.gate_node, [robot.host]
    for program in swarm.programs.values():
        if program.declared.names_its_node:
            yield program.node, [program.host]
        for space in spaces.intersection(names.above(program.node)):
            yield space, [program.host]


def _topics(swarm: Swarm) -> _Owned:
    """Topics that robots, their commanders and programs publish, with the hosts of these."""
    by_address = {host.advertised: name for name, host in swarm.hosts.items()}
    for robot in swarm.robots.values():
        for one in robot.topics:
            yield robot.full_name(one.name), [robot.host]
        if robot.gated:
            yield f"{robot.namespace}/{names.GATE_OUTPUT}", [robot.host]
        if robot.command is not None:
            addresses = (text for one in robot.commanders for text in (*one.hosts, *one.addresses))
            yield robot.command.topic, [by_address[text] for text in addresses]
    for program in swarm.programs.values():
        for topic, _ in expected_nodes.program(swarm, program).publishes:
            yield topic, [program.host]


def _seen_by(swarm: Swarm, island: Island, owned: _Owned) -> Mapping[str, list[str]]:
    """The hosts of each name, each once, as the master of ``island`` sees them."""
    found: dict[str, dict[str, None]] = {}
    for name, hosts in owned:
        there = (swarm.appears_on(host, island) for host in hosts)
        found.setdefault(name, {}).update(dict.fromkeys(there))
    return {name: list(hosts) for name, hosts in found.items()}
