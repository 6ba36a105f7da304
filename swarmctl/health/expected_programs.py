"""The programs that should run on a host, with their nodes and topics. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from swarmctl.render.bundle import package
from swarmctl.render.middleware import middleware_of
from swarmctl.robot_types.declared_topic import Topic
from swarmctl.swarm import names
from swarmctl.swarm.resolved import Host, Program, Swarm
from swarmctl.swarm.topics import COMMAND, COMMAND_TYPE


@dataclass(frozen=True)
class ExpectedProgram:
    """A program and its unit. ``node`` is empty if a launch file names it; topics are (name, type) pairs."""

    name: str
    host: str
    optional: bool
    unit: str
    node: str
    packages: tuple[str, ...]  # without which it is skipped, where that is allowed
    install_hint: str  # how the host gets these packages
    publishes: tuple[tuple[str, str], ...]
    subscribes: tuple[tuple[str, str], ...]


def programs_of(swarm: Swarm, host: Host) -> tuple[ExpectedProgram, ...]:
    """The programs of ``host`` that systemd units start; interactive ones are not checked."""
    programs = swarm.programs_on(host.name)
    return tuple(_program(swarm, host, one) for one in programs if one.runs_by_itself)


def _program(swarm: Swarm, host: Host, program: Program) -> ExpectedProgram:
    declared = program.declared
    commanded = program.commands if declared.use is not None else ()
    needed = (
        (*([declared.package] if declared.package else []), *declared.requires) if declared.optional else ()
    )
    packages = tuple(dict.fromkeys(needed))
    return ExpectedProgram(
        name=program.name,
        host=host.name,
        optional=declared.optional or host.optional,
        unit=names.unit(swarm.name, program.name),
        node=program.node if declared.launch is None else "",
        packages=packages,
        install_hint="; ".join(middleware_of(swarm.distro).install_hints([package(one) for one in packages])),
        publishes=(
            *_topics(program, declared.publishes),
            *((f"{names.namespace(robot)}/{COMMAND}", COMMAND_TYPE) for robot in commanded),
        ),
        subscribes=_topics(program, declared.subscribes),
    )


def _topics(program: Program, topics: tuple[Topic, ...]) -> tuple[tuple[str, str], ...]:
    """Full names, as registered at the master."""
    return tuple(
        (names.resolved(one.topic, program.node, program.declared.remap), one.type) for one in topics
    )
