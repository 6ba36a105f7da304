"""What the units of a host need to start, which may be gone while they run. Pure."""

from __future__ import annotations

from collections.abc import Sequence

from swarmctl.health.check_context import CheckContext
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import Verdict, bad, ok
from swarmctl.render.bundle import in_words

CHECK = "requirement"
TABLE = {
    CHECK: (("a host lacks what its release requires, such as pyserial", "unhealthy: its next start fails"),)
}


def compare(found: Findings, context: CheckContext) -> None:
    """Files one finding for each host with the release that the spec renders; others need something else."""
    for host, answer in context.hosts:
        if answer.lacks is not None and answer.release == host.release.digest:
            found.add(CHECK, host.name, _verdict(answer.lacks), host=host)


def _verdict(lacks: Sequence[str]) -> Verdict:
    if not lacks:
        return ok("has what its units need to start")
    return bad(f"the next start of its units fails: it lacks {in_words(lacks)}", "run swarmctl prepare")
