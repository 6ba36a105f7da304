"""Resolves a document to a Swarm. The document must have no errors.

A gate measures `battery` and `docked` by topics of the driver.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from swarmctl.links.bluetooth_link import RfcommLine
from swarmctl.links.link_base import Device, RobotLink
from swarmctl.spec import keystore, wireguard_keys
from swarmctl.spec.load import Document
from swarmctl.spec.maintenance_model import NO_TERMS, Maintenance
from swarmctl.spec.model import Spec
from swarmctl.spec.ros_model import Multimaster
from swarmctl.spec.selection_candidates import Candidates
from swarmctl.spec.selection_expansion import candidates_in
from swarmctl.swarm.addresses import advertised, ros_address, wireguard_network
from swarmctl.swarm.authority import Authority, commanded_by
from swarmctl.swarm.bridges import bridges_of
from swarmctl.swarm.clocks import time_root
from swarmctl.swarm.flow import peers_of
from swarmctl.swarm.flows import ros_flows
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.ports import ssh_port
from swarmctl.swarm.resolved import ForeignDriver, Host, Network, Program, Robot, Swarm, SwarmctlDriver
from swarmctl.swarm.robot_urdfs import urdfs_of
from swarmctl.swarm.ros_drivers import launchable, placeholder_values
from swarmctl.swarm.topics import MESSAGES, DriverTopic
from swarmctl.swarm.wireguard_routes import Networks


def candidates_of(index: SwarmIndex) -> Candidates:
    """Returns what can be selected in a document without errors."""
    found = candidates_in(index.document.source.root)
    return replace(
        found,
        robots={name: replace(one, host=index.driving[name]) for name, one in found.robots.items()},
        programs={name: replace(one, host=index.program_hosts[name]) for name, one in found.programs.items()},
    )


def maintenance_of(spec: Spec, robot: str) -> Maintenance:
    """Returns the terms that hold for ``robot``; a term that asks for nothing is None."""
    layers = [one for one in (spec.maintenance, spec.robots[robot].maintenance) if one is not NO_TERMS]
    wanted = {key: value for one in layers for key, value in one.model_dump(exclude_none=True).items()}
    return Maintenance(**{key: value for key, value in wanted.items() if value}) if wanted else NO_TERMS


def power_topics(topics: Iterable[DriverTopic]) -> tuple[str | None, str | None]:
    """Returns the topics of a driver with its robot's battery, and with whether it is docked."""
    found = [(one.name, one.type) for one in topics]
    battery = next((name for name, kind in found if kind == MESSAGES["battery"]), None)
    docked = (name for name, kind in found if kind == "std_msgs/Bool" and name.split("/")[-1] == "docked")
    return battery, next(docked, None)


def resolve(document: Document) -> Swarm:
    """The swarm of a document: defaults applied, types looked up, drivers placed, devices named.

    Raises ValueError if a robot or a program has no place to run, which the rules report before.
    """
    spec, index = document.spec, SwarmIndex(document)
    bridges, content = bridges_of(index), document.files.content
    flows, sealed = tuple(ros_flows(spec, index.islands, bridges)), spec.has_wireguard
    return Swarm(
        name=spec.name,
        mode=spec.mode,
        distro=spec.ros.distro,
        workspace=spec.ros.workspace,
        use_sim_time=spec.ros.use_sim_time,
        sros2=spec.ros.sros2,
        keystore={path: content[path] for path in keystore.paths(spec) if path in content},
        security=spec.security,
        overlay=str(wireguard_network(spec)) if sealed else "",
        relays=Networks(index).relays(peers_of(flows)) if sealed else {},
        wireguard_keys=wireguard_keys.text_of(content.get(wireguard_keys.path(spec.name), b"")),
        ipv6=spec.ros.ipv6,
        hosts={name: _host(name, index) for name in spec.hosts},
        robots=_robots(index),
        networks=_networks(index),
        islands=index.islands,
        bridges=bridges,
        flows=flows,
        programs=_programs(index),
        multimaster=spec.multimaster or Multimaster(),
        packages=document.packages.delivered,
        builders=spec.ros.builders,
        time=spec.time.model_copy(update={"root": time_root(spec, index.islands)}),
        candidates=candidates_of(index),
    )


def _host(name: str, index: SwarmIndex) -> Host:
    spec = index.spec
    given, defaults = spec.hosts[name], spec.defaults.host
    declared = given.model_fields_set | {
        key for key in ("user", "port") if getattr(defaults, key) is not None
    }
    return Host(
        name=name,
        address=given.address,
        ros_address=ros_address(spec, name) if name in index.home else given.address,
        advertised=advertised(spec, name),
        user=given.user if "user" in given.model_fields_set or defaults.user is None else defaults.user,
        port=ssh_port(spec, name),
        via=given.via,
        optional=given.optional,
        install=given.install,
        workspaces=given.workspaces or ((spec.ros.workspace,) if spec.ros.workspace else ()),
        declared=frozenset(declared & {"user", "port"}),
    )


def _networks(index: SwarmIndex) -> tuple[Network, ...]:
    subnets = {number: str(subnet) if subnet else None for number, subnet in index.subnets.items()}
    return tuple(
        Network(link.name, link.kind, link.hosts, subnets[number], link.multicast)
        for number, link in index.networks
    )


def _robots(index: SwarmIndex) -> Mapping[str, Robot]:
    spec, authority, urdfs = index.spec, Authority(index), urdfs_of(index.document)
    robots: dict[str, Robot] = {}
    next_rfcomm: dict[str, int] = {}  # by host
    for name, given in spec.robots.items():
        link = index.line_of(name)
        line = _line(index, link, next_rfcomm.get(link.host, 0) if link is not None else 0)
        if link is not None and isinstance(line, RfcommLine):
            next_rfcomm[link.host] = line.index + 1
        host = index.driving[name] or (link.host if link is not None else None)
        if host is None:
            raise ValueError(f"robot {name} has no host")  # ROBOT001 reports it before
        baud = index.baud_of(link) if link is not None else None
        robots[name] = Robot(
            name=name,
            namespace=index.namespaces[name],
            type_name=given.type,
            type=index.types[given.type],
            settings=index.settings_of(name),
            host=host,
            link=link,
            line=line,
            baud=baud,
            optional=given.optional,
            commanders=authority.over(name),
            driver=_driver(index, name, line, baud, _placeholders(index, name, host, line)),
            topics=index.driver_topics(name),
            command=index.command_topics.get(name),
            start=given.start,
            maintenance=maintenance_of(spec, name),
            urdf=urdfs.of(name),
        )
    return robots


def _driver(
    index: SwarmIndex, robot: str, line: Device | None, baud: int | None, values: Mapping[str, str | int]
) -> SwarmctlDriver | ForeignDriver:
    ros, type_name = index.ros_drivers.get(robot), index.spec.robots[robot].type
    if ros is None:
        if line is None or baud is None:
            raise ValueError(f"robot {robot} has no line")  # LINK001 or LINK004 reports it before
        codec = index.document.catalog.codecs.get(type_name, b"")
        return SwarmctlDriver(index.driven_robots[robot], line, baud, codec)
    return ForeignDriver(
        launchable(ros, values),
        index.motions[type_name].limited(index.settings_of(robot).limits),
        index.command_timeouts[robot],
    )


def _placeholders(index: SwarmIndex, robot: str, host: str, line: Device | None) -> Mapping[str, str | int]:
    """The values of the placeholders of a robot's driver, which runs on ``host``."""
    link, device = index.line_of(robot), line.path if line is not None else ""
    of_link = index.placeholders_of_link(link, device) if link is not None else {}
    address = ros_address(index.spec, host)
    return placeholder_values(robot, index.namespaces[robot], host, address, of_link)


def _programs(index: SwarmIndex) -> Mapping[str, Program]:
    programs: dict[str, Program] = {}
    for name, given in index.spec.programs.items():
        host = index.program_hosts[name]
        if host is None:
            raise ValueError(f"program {name} has no host")  # PROG006 reports it before
        beside = {path: index.document.files.content[path] for path in given.beside}
        programs[name] = Program(
            name, host, index.program_nodes[name], given, commanded_by(index.spec, name), beside
        )
    return programs


def _line(index: SwarmIndex, link: RobotLink | None, number: int) -> Device | None:
    """The device of a link, if any. ``number``: the next free one of the rfcomm devices on its host."""
    if link is None:
        return None
    of_type = index.native_robots.get(link.robot)
    channel = of_type.link.rfcomm_channel if of_type is not None else 1
    return link.device_of(number, channel, index.adapter_of(link) or "")
