"""The driver of a robot: its node, or the nodes that its launch file starts. Pure."""

from __future__ import annotations

from swarm_onboard.agent.observations import LaunchedSeen, NodeSeen
from swarm_onboard.agent.systemd import UnitState

from swarmctl.health import launched_nodes
from swarmctl.health.check_context import CheckContext
from swarmctl.health.checks import link, unit
from swarmctl.health.expected_graph import ExpectedHost, ExpectedRobot
from swarmctl.health.launched_nodes import LaunchedDriver
from swarmctl.health.root_cause import Findings
from swarmctl.health.unit_faults import absent, dead, moved, unchecked
from swarmctl.health.verdict import State, Verdict, bad, ok, unknown

TABLE = {
    "driver": (
        ("the node of a driver is not registered, or does not answer", "unhealthy"),
        ("it advertises another address than that of its host", "unhealthy"),
        ("it does not subscribe to its command topic, or with another type", "unhealthy"),
        ("it lacks a declared service or action, or its type differs", "unhealthy"),
        ("a second process has its name", "a warning, with the command that ends it"),
        *launched_nodes.TABLE,
    )
}


def compare(found: Findings, context: CheckContext) -> None:
    """Files a finding for each robot."""
    for host, robot, answer in context.robots():
        if robot.node:
            judged = verdict(robot, host, answer.units.get(robot.unit), answer.nodes.get(robot.node))
        else:
            judged = launched(robot, host, answer.launched.get(robot.unit))
        found.add("driver", robot.name, judged, robot=robot, after=causes(context, host, robot))


def causes(context: CheckContext, host: ExpectedHost, robot: ExpectedRobot) -> list[str]:
    """Returns what may explain that a driver does not run, most basic cause first."""
    return [
        *context.rivals(host.name, robot.unit),
        f"master {host.name}",
        f"discovery {host.name}",
        *link.keys(context.graph, host),
        f"environment {robot.name}",
        f"override {host.name} {robot.unit}",
        f"probe {host.name} ros",
        *([] if robot.node else [f"device {robot.name}"]),
        unit.key(host.name, robot.unit),
        f"release {host.name}",
        *([] if robot.node else [f"probe {host.name} launched"]),
    ]


def verdict(
    robot: ExpectedRobot, host: ExpectedHost, process: UnitState | None, seen: NodeSeen | None
) -> Verdict:
    """Checks the driver's node on ``host``. ``process``: its unit."""
    restart = f"on {robot.host}: sudo systemctl restart {robot.unit}"
    if seen is None or seen.registered is None:
        return unknown(unchecked(robot.node, seen))
    runs = process is not None and process.runs
    if not seen.registered:
        if process is not None and runs and process.recent:
            text = f"{robot.node} {absent(host)}: its unit was {unit.times(process.recent)}, last result"
            return bad(
                f"{text} {unit.ending(process)}", f"on {robot.host}: sudo journalctl -u {robot.unit} -n 50"
            )
        why = " although its unit runs" if runs else ""
        why += "; the master may have been restarted" if runs and host.master_uri else ""
        return bad(f"{robot.node} {absent(host)}{why}", restart)
    if not seen.alive and host.master_uri:
        text = "is registered and its unit runs, but it" if runs else "is a stale registration: it"
        return bad(f"{robot.node} {text} does not answer ({seen.error})", restart)
    if not seen.alive:
        return bad(f"{robot.node} {dead(host, seen)}", restart)
    if other := moved(host, seen):
        hint = "ROS_IP or ROS_HOSTNAME is overridden; run swarmctl deploy, then restart the unit"
        return bad(f"{robot.node} {other}", hint if host.master_uri else restart)
    if wrong := _wrong(robot, seen, restart):
        return wrong
    own = process.pid if process is not None and robot.guarded else 0
    if own and seen.pid and own != seen.pid:
        text = f"{robot.node} is process {seen.pid}, but its unit runs {own}: a second driver has its name"
        return Verdict(
            State.WARNING, text, f"on {robot.host}: sudo kill {seen.pid}; sudo systemctl restart {robot.unit}"
        )
    return ok(f"{robot.node} runs")


def _wrong(robot: ExpectedRobot, seen: NodeSeen, restart: str) -> Verdict | None:
    """What the driver's node lacks of its command topic, its services and its actions."""
    command, wanted = robot.takes
    if command and command not in seen.subscribes:
        lost = "commands are lost" if robot.gate is None else "no command that passes the gate reaches it"
        return bad(f"{robot.node} does not subscribe to {command}: {lost}", restart)
    if command and (kind := seen.subscribes[command]) not in (wanted, "*"):
        return bad(f"{robot.node} subscribes to {command} as {kind} instead of {wanted}")
    for name, kind in robot.provides:
        if (known := seen.provides.get(name)) not in (kind, ""):
            other = f"provides {name} as {known} instead of {kind}" if known else f"does not provide {name}"
            return bad(f"{robot.node} {other}", restart)
    return None


def launched(robot: ExpectedRobot, host: ExpectedHost, seen: LaunchedSeen | None) -> Verdict:
    """Checks the nodes of a robot's driver that is a launch file."""
    commands = (robot.takes,) if robot.command else ()
    expected = LaunchedDriver(robot.unit, subscribes=commands, provides=robot.provides)
    found = launched_nodes.problem(expected, host, seen)
    started = {} if seen is None else seen.starts
    return found or ok(f"{', '.join(started)} runs" if started else "its launch file runs")
