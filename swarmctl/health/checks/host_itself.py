"""The host itself, such as its disks: each check is a module of ``swarm_onboard.host_checks``. Pure."""

from __future__ import annotations

from swarm_onboard.host_checks import Judged

from swarmctl.health.check_context import CheckContext
from swarmctl.health.host_checks import host_checks
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import State, Verdict

TABLE = {name: check.TABLE for name, check in host_checks().items()}


def compare(found: Findings, context: CheckContext) -> None:
    """Files one finding for each part that a host reports."""
    for host, answer in context.hosts:
        for name, check in host_checks().items():
            for seen in answer.checks.get(name, ()):
                judged = check.judge(seen, host.name)
                if judged.peer in context.graph.expelled:
                    judged = _accepts(judged.peer)
                elif judged.peer and judged.peer not in context.answers:
                    continue  # why it does not answer is a finding of its own
                verdict = Verdict(State(judged.state), judged.message, judged.hint)
                subject = " ".join(filter(None, (host.name, judged.about)))
                found.add(name, subject, verdict, host=host, after=_clocks(context, host.name, judged.peer))


def _clocks(context: CheckContext, host: str, peer: str) -> list[str]:
    """Returns the keys of the clocks that may explain a missing handshake: WireGuard refuses an old time.

    The age of a handshake is wrong as well where the host's own clock was set.
    """
    if not peer:
        return []
    ahead = {one: context.answers[one].clock_ahead or 0.0 for one in (host, peer)}
    return [f"clock {one}" for one in (host, peer) if one == host or ahead[peer] < ahead[host]]


def _accepts(lost: str) -> Judged:
    return Judged(
        "bad",
        f"its WireGuard accepts {lost}, which was expelled while this host did not answer",
        "`swarmctl deploy` finishes it",
        about=lost,
    )
