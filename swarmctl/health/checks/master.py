"""The master of an island, as each of its hosts reaches it. Pure."""

from __future__ import annotations

from urllib.parse import urlsplit

from swarm_onboard.agent.observations import MasterSeen
from swarm_onboard.agent.systemd import UnitState

from swarmctl.health.check_context import CheckContext
from swarmctl.health.checks import link, unit
from swarmctl.health.expected_graph import ExpectedHost
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import Verdict, bad, ok, unknown

TABLE = {
    "master": (
        ("a host does not reach the master of its island", "unhealthy"),
        ("another process has its port", "unhealthy, with the command that finds it"),
        ("another machine has its address, or it has lost its parameters", "unhealthy"),
    )
}


def compare(found: Findings, context: CheckContext) -> None:
    """Files a finding for each host with a master to reach."""
    for host, answer in context.hosts:
        if not host.master_uri:
            continue
        foreign, probe = context.has_foreign_master(host), f"probe {host.name} ros"
        hub = context.answers.get(host.hub)
        if host.is_hub:
            # One that has the port is why the unit does not run.
            run_id, after = "", [probe] if foreign else [probe, unit.key(host.name, host.master_unit)]
        else:
            run_id = hub.master.run_id if hub is not None and hub.master is not None else ""
            after = [context.reached(host.hub), f"master {host.hub}", *link.keys(context.graph, host), probe]
        process = context.master_processes.get(host.hub)
        verdict = _verdict(host, answer.master, run_id, process, foreign=foreign)
        found.add("master", host.name, verdict, host=host, after=after)


def _verdict(
    host: ExpectedHost, seen: MasterSeen | None, run_id: str, process: UnitState | None, *, foreign: bool
) -> Verdict:
    """Checks the master as ``host`` reaches it.

    ``run_id``: of the master as its hub sees it, or empty; ``process``: the unit of the master on its hub;
    ``foreign``: that does not run, and another master has its port.
    """
    if seen is None:
        return unknown("was not checked")
    if not seen.reachable:
        hint = f"check the route from {host.name} to {host.hub}: address, firewall, wireless client isolation"
        text = f"{host.master_uri} does not answer: {seen.error}"
        return bad(text, f"on {host.name}: systemctl status {host.master_unit}" if host.is_hub else hint)
    if foreign:
        port = urlsplit(host.master_uri or "").port
        text = f"another master answers at {host.master_uri}: that of {host.hub} does not run"
        log = unit.log_of(process) if process is not None else ""
        return bad(text + log, f"on {host.hub}, to find it: sudo ss -ltnp sport = :{port}")
    if not seen.run_id:
        text = f"{host.master_uri} answers, and has lost its parameters: /run_id is not set"
        return bad(text, f"on {host.name}: sudo systemctl restart {host.master_unit}" if host.is_hub else "")
    if run_id and seen.run_id != run_id:
        text = f"another master than that of {host.hub} answers at {host.master_uri}"
        return bad(text, "check whether a second machine has this address")
    return ok(f"answers in {seen.latency * 1000:.1f} ms")
