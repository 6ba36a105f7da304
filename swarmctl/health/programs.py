"""The programs that should run on a host, with their nodes and topics. Pure; knows no host's answer."""

from __future__ import annotations

from dataclasses import dataclass

from swarmctl.spec.topics import Topic
from swarmctl.topology import names
from swarmctl.topology.interfaces import COMMAND, COMMAND_TYPE
from swarmctl.topology.swarm import Host, Program, Swarm


@dataclass(frozen=True)
class ExpectedProgram:
    """A program and its unit. ``node`` is empty where its launch file alone knows; topics have types."""

    name: str
    host: str
    optional: bool
    unit: str
    node: str
    packages: tuple[str, ...]  # without which it is skipped, where that is allowed
    publishes: tuple[tuple[str, str], ...]
    hears: tuple[tuple[str, str], ...]


def programs_of(swarm: Swarm, host: Host) -> tuple[ExpectedProgram, ...]:
    """What runs on ``host`` by itself; who starts a program at a terminal knows how it is."""
    programs = swarm.programs_on(host.name)
    return tuple(_program(swarm, host, one) for one in programs if one.runs_by_itself)


def _program(swarm: Swarm, host: Host, program: Program) -> ExpectedProgram:
    said = program.said
    orders = program.commands if said.use is not None else ()
    packages = (*([said.package] if said.package else []), *said.requires) if said.optional else ()
    return ExpectedProgram(
        name=program.name,
        host=host.name,
        optional=said.optional or host.optional,
        unit=names.unit(swarm.name, program.name),
        node=program.node if said.launch is None else "",
        packages=tuple(dict.fromkeys(packages)),
        publishes=(
            *_topics(program, said.publishes),
            *((f"{names.namespace(robot)}/{COMMAND}", COMMAND_TYPE) for robot in orders),
        ),
        hears=_topics(program, said.subscribes),
    )


def _topics(program: Program, topics: tuple[Topic, ...]) -> tuple[tuple[str, str], ...]:
    """Full names, as the master has them."""
    return tuple((names.resolved(one.topic, program.node, program.said.remap), one.type) for one in topics)
