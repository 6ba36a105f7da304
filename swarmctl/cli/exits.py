"""Exit codes, the same for every verb."""

from __future__ import annotations

OK = 0
ERROR = 1
CHANGES = 2
HOSTS_FAILED = 3
HOSTS_UNREACHABLE = 4
UNHEALTHY = 5
USAGE = 64
INTERRUPTED = 130

MEANING = {
    OK: "done, or nothing is wrong",
    ERROR: "the spec is wrong, or swarmctl could not do what it was asked",
    CHANGES: "plan --detailed-exitcode: there is something to do",
    HOSTS_FAILED: "some hosts failed",
    HOSTS_UNREACHABLE: "some hosts could not be reached, none failed",
    UNHEALTHY: "unhealthy",
    USAGE: "wrong use of the command line",
    INTERRUPTED: "interrupted",
}


def told(*codes: int) -> str:
    """The codes that a verb can end with beside those that every verb can, for the end of its help."""
    named = sorted({OK, ERROR, *codes, USAGE, INTERRUPTED})
    return f"Exit codes: {'; '.join(f'{code} {MEANING[code]}' for code in named)}."
