"""A checked document to the resolved swarm. Trusts that the checks found no error."""

from __future__ import annotations

from collections.abc import Mapping

from swarmctl.spec import model
from swarmctl.spec.load import Document
from swarmctl.spec.multimaster import Multimaster
from swarmctl.spec.robot_type import RobotType
from swarmctl.spec.settings import merged
from swarmctl.topology import modes, names
from swarmctl.topology.authority import Authority, commanded_by
from swarmctl.topology.bridges import bridges_of
from swarmctl.topology.clocks import time_root
from swarmctl.topology.interfaces import program_endpoints, program_host
from swarmctl.topology.networks import addresses_of, advertised, subnets_of, witnesses_of
from swarmctl.topology.ports import ssh_port
from swarmctl.topology.swarm import (
    FixedLine,
    Host,
    Line,
    Network,
    Program,
    RfcommLine,
    Robot,
    Swarm,
    UsbLine,
)


def resolve(document: Document) -> Swarm:
    """Apply defaults, look up types and computers, place drivers, give devices their names."""
    spec = document.spec
    islands = modes.islands_of(spec)
    home = {host: island for island in islands for host in island.hosts}
    return Swarm(
        name=spec.name,
        mode=spec.mode,
        distro=spec.ros.distro,
        workspace=spec.ros.workspace,
        hosts={name: _host(name, document) for name in spec.hosts},
        robots=_robots(document, Authority(spec, home)),
        networks=_networks(spec),
        islands=islands,
        bridges=bridges_of(spec, document.types, islands, tuple(program_endpoints(spec))),
        programs=_programs(spec),
        multimaster=spec.multimaster or Multimaster(),
        time=spec.time.model_copy(update={"root": time_root(spec, islands)}),
    )


def _host(name: str, document: Document) -> Host:
    given, defaults = document.spec.hosts[name], document.spec.defaults.host
    said = given.model_fields_set
    return Host(
        name=name,
        address=given.address,
        advertised=advertised(document.spec, name),
        user=given.user if "user" in said or defaults.user is None else defaults.user,
        port=ssh_port(document.spec, name),
        via=given.via,
        optional=given.optional,
    )


def _networks(spec: model.Spec) -> tuple[Network, ...]:
    addresses = addresses_of(spec)
    subnets = subnets_of(spec, addresses, witnesses_of(spec, addresses))
    return tuple(
        Network(
            link.name, link.kind, link.hosts, str(subnets[index]) if subnets[index] else None, link.multicast
        )
        for index, link in enumerate(spec.links)
        if isinstance(link, model.NetworkLink)
    )


def _robots(document: Document, authority: Authority) -> Mapping[str, Robot]:
    spec = document.spec
    robots: dict[str, Robot] = {}
    next_index: dict[str, int] = {}
    types = document.types
    lines = {link.robot: link for link in spec.links if isinstance(link, (model.Serial, model.Bluetooth))}
    for name, given in spec.robots.items():
        robot_type = types[given.type]
        link = lines[name]
        line = _line(link, robot_type, spec.hosts[link.host].bluetooth, next_index.get(link.host, 0))
        if isinstance(line, RfcommLine):
            next_index[link.host] = line.index + 1
        robots[name] = Robot(
            name=name,
            type_name=given.type,
            type=robot_type,
            settings=merged(spec.defaults.robot, robot_type.settings, given.settings),
            host=modes.driving_host(spec, name) or link.host,
            line=line,
            baud=link.baud if isinstance(link, model.Serial) else None,
            optional=given.optional,
            commanders=authority.over(name),
            codec=document.catalog.codecs.get(given.type, b""),
            driver=given.driver,
        )
    return robots


def _programs(spec: model.Spec) -> Mapping[str, Program]:
    programs: dict[str, Program] = {}
    for name, said in spec.programs.items():
        host = program_host(spec, said)
        if host is None:
            raise ValueError(f"program {name} runs nowhere")  # PROG006 found that before
        node = names.program_node(name, said.robot)
        programs[name] = Program(name, host, node, said, commanded_by(spec, name))
    return programs


def _line(
    link: model.Serial | model.Bluetooth, robot_type: RobotType, adapters: tuple[str, ...], index: int
) -> Line:
    match link:
        case model.Bluetooth():
            channel = link.channel or robot_type.link.rfcomm_channel
            pin = link.pin.secret if link.pin else None
            return RfcommLine(link.mac, channel, index, link.adapter or adapters[0], pin)
        case model.Serial(usb=model.Usb() as usb):
            return UsbLine(usb, names.usb_device(link.robot))
        case model.Serial(device=str() as device):
            return FixedLine(device)
    raise ValueError(f"the line of {link.robot} names no device")  # LINK004 found that before
