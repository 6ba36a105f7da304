"""Whether a host answered, and which parts of itself it could not look at. Pure."""

from __future__ import annotations

from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.check_context import CheckContext
from swarmctl.health.root_cause import HOST, Findings
from swarmctl.health.verdict import Verdict, bad, ok, unknown
from swarmctl.remote.transport import HostError, Kind

SYSTEMD = "systemd"
_REFUSALS = {
    Kind.HOST_KEY: "the key of a host is not pinned, or is not the pinned one",
    Kind.AUTH: "a host accepts no key of the operator",
    Kind.PRIVILEGE: "the account of a host is not root, and sudo refuses",
    Kind.PROTOCOL: "the answer of a host is none of the agent's",
    Kind.REFUSED: "the agent rejects the request",
    Kind.FAILED: "the agent fails",
    Kind.BUG: "a bug in swarmctl",
}
TABLE = {
    HOST: (("a host cannot be reached, or its connection is lost", "unhealthy"),),
    "probed": (("a host was not probed, as the run was interrupted", "unknown"),),
    **{kind.value: ((text, "unhealthy"),) for kind, text in _REFUSALS.items()},
    "probe": (("the probe could not look at a part of a host", "unknown, with the reason"),),
    SYSTEMD: (("systemd of a host does not answer within 10 s", "unhealthy: no unit is restarted"),),
    "robot": (("the host of a robot could not be probed", "unknown"),),
}


def compare(found: Findings, context: CheckContext) -> None:
    """Files whether each host answered, what its probe missed, and the robots of those that did not."""
    for host in context.graph.hosts:
        outcome = context.outcomes.get(host.name, HostError(Kind.STOPPED, "was not probed"))
        key = context.reached(host.name)
        found.add(key.removesuffix(f" {host.name}"), host.name, _verdict(outcome), host=host)
        if isinstance(outcome, HostError):
            for robot in host.robots:
                not_probed = unknown("its host could not be probed")
                found.add("robot", robot.name, not_probed, robot=robot, after=[key])
        else:
            for part, why in outcome.troubles.items():
                if part == SYSTEMD:
                    found.add(SYSTEMD, host.name, _silent(host.name, why), host=host)
                else:
                    found.add("probe", f"{host.name} {part}", unknown(why), host=host)


def _verdict(outcome: Answer | HostError) -> Verdict:
    if not isinstance(outcome, HostError):
        return ok("answers")
    stopped = outcome.kind is Kind.STOPPED
    return unknown(outcome.message) if stopped else bad(outcome.message, outcome.hint)


def _silent(host: str, why: str) -> Verdict:
    log = f"on {host}: sudo journalctl -b _PID=1 -n 20"
    again = "if it has crashed, stop the robots of the host, then: sudo reboot -ff"
    return bad(f"{why}: it restarts no unit that ends", f"{log}; {again}")
