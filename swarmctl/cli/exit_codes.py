"""Exit codes, the same for every verb."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Set

    from swarmctl.plan.plan import Plan

OK = 0
ERROR = 1
CHANGES = 2
HOSTS_FAILED = 3
HOSTS_UNREACHABLE = 4
UNHEALTHY = 5
NOT_PROVEN = 6
USAGE = 64
INTERRUPTED = 130

MEANING = {
    OK: "success",
    ERROR: "the spec has errors, or the command failed",
    CHANGES: "plan --detailed-exitcode: there are changes",
    HOSTS_FAILED: "some hosts failed",
    HOSTS_UNREACHABLE: "some hosts are unreachable, none failed",
    UNHEALTHY: "the swarm is unhealthy",
    NOT_PROVEN: "a stop was sent, standstill not confirmed",
    USAGE: "usage error",
    INTERRUPTED: "interrupted",
}


def epilog(*codes: int) -> str:
    """The last line of a verb's help: its own exit ``codes`` and those of every verb."""
    named = sorted({OK, ERROR, *codes, USAGE, INTERRUPTED})
    return f"Exit codes: {'; '.join(f'{code} {MEANING[code]}' for code in named)}."


def of_plan(made: Plan, optional: Set[str], *, detailed: bool) -> int:
    """The exit code of a plan; unreachable optional hosts do not count."""
    kinds = {host.host: host.problem.kind for host in made.problems if host.problem}
    kinds = {host: kind for host, kind in kinds.items() if kind != "unreachable" or host not in optional}
    if kinds:
        unreachable = set(kinds.values()) == {"unreachable"}
        return HOSTS_UNREACHABLE if unreachable else HOSTS_FAILED
    return CHANGES if detailed and made.changes else OK
