"""The programs that should run on a host, with their nodes and topics. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from swarmctl.render.bundle import package
from swarmctl.render.middleware import middleware_at
from swarmctl.spec.program_model import Container
from swarmctl.swarm.resolved import Host, Program, Swarm
from swarmctl.swarm.topics import CLOCK, DriverTopic


@dataclass(frozen=True)
class ExpectedProgram:
    """A program and its unit. ``node`` is empty if nothing names it; topics are (name, type) pairs.

    ``measured``: those that it publishes at a declared rate; ``provides``: services and actions, alike.
    """

    name: str
    host: str
    optional: bool
    unit: str
    node: str
    packages: tuple[str, ...]  # without which it is skipped, where that is allowed
    install_hint: str  # how the host gets these packages
    publishes: tuple[tuple[str, str], ...]
    subscribes: tuple[tuple[str, str], ...]
    oneshot: bool = False  # it ends, and its exit code is checked
    measured: tuple[DriverTopic, ...] = ()
    container: Container | None = None
    provides: tuple[tuple[str, str], ...] = ()

    @property
    def gives_time(self) -> bool:
        """True if nodes have their time from it, where time is simulated."""
        return any(name == CLOCK for name, _ in self.publishes)


def programs_of(swarm: Swarm, host: Host) -> tuple[ExpectedProgram, ...]:
    """Returns the programs of ``host`` that systemd units start; interactive ones are not checked."""
    programs = swarm.programs_on(host.name)
    return tuple(_program(swarm, host, one) for one in programs if one.runs_by_itself)


def _program(swarm: Swarm, host: Host, program: Program) -> ExpectedProgram:
    declared = program.declared
    needed = (
        (*([declared.package] if declared.package else []), *declared.requires) if declared.optional else ()
    )
    packages = tuple(dict.fromkeys(needed))
    middleware = middleware_at(swarm, host.name)
    node = middleware.program(swarm, program)
    return ExpectedProgram(
        name=program.name,
        host=host.name,
        optional=declared.optional or host.optional,
        unit=node.unit,
        node=node.name,
        packages=packages,
        install_hint="; ".join(middleware.install_hints([package(one) for one in packages])),
        publishes=node.publishes,
        subscribes=node.subscribes,
        oneshot=declared.lifecycle == "oneshot",
        measured=node.measured,
        container=declared.container,
        provides=node.provides,
    )
