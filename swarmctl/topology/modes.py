"""The five working modes as islands: who shares a ROS graph, who runs its master, who drives which robot."""

from __future__ import annotations

from dataclasses import dataclass

from swarmctl.spec.model import Mode, Spec
from swarmctl.topology.swarm import Island

READY = (Mode.SINGLE_MINDED, Mode.LEADER, Mode.CENTRAL)


@dataclass(frozen=True)
class Role:
    """The host a mode needs by name: the key that names it, and what it does there."""

    key: str
    duty: str


# Which host a mode is built around (paper, section 4).
ROLES = {
    Mode.SINGLE_MINDED: Role("leader", "runs the master and every driver"),
    Mode.LEADER: Role("leader", "runs the master and commands the others"),
    Mode.CENTRAL: Role("hub", "runs the master that all robots connect to"),
}


def hub_of(spec: Spec) -> str | None:
    """The host that runs the master of a one-island mode, or nothing while the spec does not name it."""
    role = ROLES.get(spec.mode)
    return getattr(spec, role.key) if role else None


def driving_host(spec: Spec, robot: str) -> str | None:
    """The host that runs a robot's driver: its own; in mode single-minded always the leader."""
    if spec.mode is Mode.SINGLE_MINDED:
        return spec.leader
    return spec.robots[robot].host


def islands_of(spec: Spec) -> tuple[Island, ...]:
    """The islands of a spec whose mode is in ``READY`` and whose hub is named."""
    hub = hub_of(spec)
    if hub is None:
        return ()
    members = (hub,) if spec.mode is Mode.SINGLE_MINDED else tuple(spec.hosts)
    return (Island(name=spec.name, hub=hub, hosts=members, master_port=spec.ros.master_port),)
