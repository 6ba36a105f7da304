"""Whether a hub can connect to the nodes that take commands on other hosts. Pure.

The master announces new publishers to a subscriber by a call to its URI (ROS wiki, Slave API,
``publisherUpdate``). Where a firewall drops that call, a driver runs, publishes, and receives no command.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from swarmctl.health import checks
from swarmctl.health.expected_graph import ExpectedHost, ExpectedRobot
from swarmctl.health.observations import Answer
from swarmctl.health.root_cause import Findings


def peers_of(hosts: Iterable[ExpectedHost], hub: ExpectedHost) -> Iterator[str]:
    """Yields the nodes to which ``hub`` connects, of an island with these ``hosts``."""
    for host in hosts:
        if host.name != hub.name:
            yield from (robot.guard_node for robot in host.robots if robot.guard_node)


def compare(
    found: Findings, host: ExpectedHost, robot: ExpectedRobot, hub: Answer | None, after: Iterable[str]
) -> None:
    """Files a finding if the hub has tried to connect to the node that takes the commands of ``robot``."""
    if hub is None or robot.guard_node not in hub.peers:
        return
    verdict = checks.ok("can be connected to")
    if why := hub.peers[robot.guard_node]:
        where = f"{robot.guard_node} on {host.name}"
        verdict = checks.bad(
            f"{host.hub} cannot connect to {where}: {why}; commands of nodes that start now do not arrive",
            f"check the firewall on {host.name}: sudo nft list ruleset; all ports must be open to {host.hub}",
        )
    found.add("peer", robot.name, verdict, robot=robot, after=after)
