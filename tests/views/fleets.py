"""Swarms of many equal hosts: what they answer to ``status``, and what ``plan`` finds on them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from swarm_onboard.agent.observations import NodeSeen
from swarm_onboard.agent.steps import Kind, Step

from swarmctl.health.diagnosis import diagnose
from swarmctl.health.expected_graph import ExpectedGraph, Release, expected_graph
from swarmctl.health.swarm_health import Status, status
from swarmctl.plan.plan import HostPlan, Plan, Problem
from swarmctl.remote.transport import HostError
from swarmctl.views.equal_hosts import Names
from tests.health.swarm_values import well
from tests.loading import load_swarm

SPEC = """
version: 1
name: fleet
mode: leader
leader: desk
hosts:
  desk: {address: 10.1.0.250, computer: laptop}
  tb-[001-NNN]: {address: "10.1.0.[1-NNN]", computer: raspberry-pi-4b}
robots:
  rover-[001-NNN]: {type: khepera3, host: "tb-[001-NNN]"}
links:
  - {kind: wlan, name: lab, hosts: [desk, "tb-[001-NNN]"], multicast: true}
  - {kind: serial, host: "tb-[001-NNN]", robot: "rover-[001-NNN]", usb: {serial: "FT[001-NNN]"}}
control:
  - {by: desk, of: ["rover-[001-NNN]"]}
"""
CREATED = tuple(f"params/{name}.yaml" for name in "abcdefgh")


@cache
def graph(count: int) -> ExpectedGraph:
    """A desk and ``count`` equal hosts with a robot each."""
    with TemporaryDirectory() as folder:
        file = Path(folder, "swarm.yaml")
        file.write_text(SPEC.replace("NNN", f"{count:03}"))
        swarm, found = load_swarm(file)
    assert swarm is not None, found
    units = ("swarm-fleet.wlan.service", "swarm-fleet.{}.service", "swarm-fleet.target")
    releases = {
        name: Release(f"{number:016x}", tuple(unit.format(name.replace("tb", "rover")) for unit in units))
        for number, name in enumerate(swarm.hosts)
    }
    return expected_graph(swarm, releases)


def _faster(node: NodeSeen, by: float) -> NodeSeen:
    rates = {at: one._replace(rate=(one.rate or 0) + by) for at, one in node.topics.items()}
    return node._replace(topics=rates)


def answers(count: int) -> dict[str, Any]:
    """All is well, with a different latency and rates on each host."""
    found: dict[str, Any] = {}
    for number, host in enumerate(graph(count).hosts):
        answer = well(host)
        nodes = {name: _faster(node, number % 5 / 10) for name, node in answer.nodes.items()}
        latency = 0.001 + number / 10_000
        found[host.name] = answer._replace(nodes=nodes, master=answer.master._replace(latency=latency))
    return found


def seen(count: int, changes: Mapping[str, Any] | None = None) -> Status:
    """The status of ``count`` hosts, of which ``changes`` answer otherwise."""
    outcomes: dict[str, Any] = {**answers(count), **(changes or {})}
    return status(graph(count), outcomes, diagnose(graph(count), outcomes))


def away(number: int) -> HostError:
    """What is known of host ``number`` when it does not answer."""
    from swarmctl.remote.transport import Kind as ErrorKind

    return HostError(ErrorKind.UNREACHABLE, f"no answer from 10.1.0.{number}", "is it switched on?")


def names(count: int) -> dict[str, Names]:
    return {f"tb-{n:03}": Names(f"tb-{n:03}", f"10.1.0.{n}", (f"rover-{n:03}",)) for n in range(1, count + 1)}


def host_plan(number: int, *steps: Step) -> HostPlan:
    """A first deploy to host ``number``, and ``steps``."""
    created = [Step(Kind.CREATE, path, f"new, from robots.rover-{number:03}") for path in CREATED]
    start = Step(Kind.START, f"swarm-fleet.rover-{number:03}.service", "new")
    return HostPlan(f"tb-{number:03}", None, f"{number:016x}", (*created, start, *steps))


def planned(count: int, *others: HostPlan) -> Plan:
    """A first deploy to ``count`` equal hosts, in which ``others`` replace those of their name."""
    replaced = {one.host: one for one in others}
    hosts = [host_plan(number) for number in range(1, count + 1)]
    return Plan("fleet", tuple(replaced.get(one.host, one) for one in hosts))


def stuck(number: int) -> HostPlan:
    problem = Problem("unreachable", f"tb-{number:03} (10.1.0.{number}, port 22): timed out", "is it on?")
    return HostPlan(f"tb-{number:03}", None, "0" * 16, problem=problem)
