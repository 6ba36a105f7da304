"""Resolves a document to a Swarm. The document must have no errors."""

from __future__ import annotations

from collections.abc import Mapping

from swarmctl.robot_types.robot_type import RobotType
from swarmctl.spec import model
from swarmctl.spec.load import Document
from swarmctl.spec.multimaster_model import Multimaster
from swarmctl.swarm import names
from swarmctl.swarm.authority import Authority, commanded_by
from swarmctl.swarm.bridges import bridges_of
from swarmctl.swarm.clocks import time_root
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.ports import ssh_port
from swarmctl.swarm.resolved import (
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
from swarmctl.swarm.subnets import advertised


def resolve(document: Document) -> Swarm:
    """The swarm of a document: defaults applied, types looked up, drivers placed, devices named.

    Raises ValueError if a robot or a program has no place to run, which the rules report before.
    """
    spec, index = document.spec, SwarmIndex(document)
    return Swarm(
        name=spec.name,
        mode=spec.mode,
        distro=spec.ros.distro,
        workspace=spec.ros.workspace,
        hosts={name: _host(name, spec) for name in spec.hosts},
        robots=_robots(index),
        networks=_networks(index),
        islands=index.islands,
        bridges=bridges_of(index),
        programs=_programs(index),
        multimaster=spec.multimaster or Multimaster(),
        time=spec.time.model_copy(update={"root": time_root(spec, index.islands)}),
    )


def _host(name: str, spec: model.Spec) -> Host:
    given, defaults = spec.hosts[name], spec.defaults.host
    declared = given.model_fields_set | {
        key for key in ("user", "port") if getattr(defaults, key) is not None
    }
    return Host(
        name=name,
        address=given.address,
        advertised=advertised(spec, name),
        user=given.user if "user" in given.model_fields_set or defaults.user is None else defaults.user,
        port=ssh_port(spec, name),
        via=given.via,
        optional=given.optional,
        declared=frozenset(declared & {"user", "port"}),
    )


def _networks(index: SwarmIndex) -> tuple[Network, ...]:
    subnets = {number: str(subnet) if subnet else None for number, subnet in index.subnets.items()}
    return tuple(
        Network(link.name, link.kind, link.hosts, subnets[number], link.multicast)
        for number, link in index.networks
    )


def _robots(index: SwarmIndex) -> Mapping[str, Robot]:
    spec, authority = index.spec, Authority(index)
    robots: dict[str, Robot] = {}
    next_rfcomm: dict[str, int] = {}  # by host
    for name, given in spec.robots.items():
        robot_type, link = index.types[given.type], index.line_of(name)
        if link is None:
            raise ValueError(f"robot {name} has no line")  # LINK001 reports it before
        line = _line(index, link, robot_type, next_rfcomm.get(link.host, 0))
        if isinstance(line, RfcommLine):
            next_rfcomm[link.host] = line.index + 1
        robots[name] = Robot(
            name=name,
            type_name=given.type,
            type=robot_type,
            settings=index.settings_of(name),
            host=index.driving[name] or link.host,
            line=line,
            baud=link.baud if isinstance(link, model.Serial) else None,
            optional=given.optional,
            commanders=authority.over(name),
            codec=index.document.catalog.codecs.get(given.type, b""),
            driver=given.driver,
        )
    return robots


def _programs(index: SwarmIndex) -> Mapping[str, Program]:
    programs: dict[str, Program] = {}
    for name, given in index.spec.programs.items():
        host = index.program_hosts[name]
        if host is None:
            raise ValueError(f"program {name} has no host")  # PROG006 reports it before
        node = names.program_node(name, given.robot)
        programs[name] = Program(name, host, node, given, commanded_by(index.spec, name))
    return programs


def _line(
    index: SwarmIndex, link: model.Serial | model.Bluetooth, robot_type: RobotType, rfcomm: int
) -> Line:
    """The device of a line; ``rfcomm`` is the next free number of a Bluetooth device on its host."""
    match link:
        case model.Bluetooth():
            channel = link.channel or robot_type.link.rfcomm_channel
            pin = link.pin.secret if link.pin else None
            return RfcommLine(link.mac, channel, rfcomm, index.adapter_of(link) or "", pin)
        case model.Serial(usb=model.Usb() as usb):
            return UsbLine(usb, names.usb_device(link.robot))
        case model.Serial(device=str() as device):
            return FixedLine(device)
    raise ValueError(f"the line of {link.robot} names no device")  # LINK004 reports it before
