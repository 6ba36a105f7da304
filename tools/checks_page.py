"""Prints docs/checks.md from the modules of ``swarmctl.health.checks``."""

from __future__ import annotations

import sys
from collections.abc import Iterator

from swarmctl.health.diagnosis import all_checks

HEAD = """\
# The checks of status

Each check is a module of `swarmctl/health/checks/`, or, for a host itself, of
`templates/onboard/swarm_onboard/host_checks/`. From these `make generated` writes this page. The names are
those in `swarmctl status --json`. What a swarm does not have, such as a radio or a gate, has no finding.
[status.md](status.md) says how status looks, and what follows from what it finds.

| check | observed | verdict |
|---|---|---|
"""


def rows() -> Iterator[str]:
    tables = [table for check in all_checks() for table in check.TABLE.items()]
    for name, table in sorted(tables):
        for observed, verdict in table:
            yield f"| `{name}` | {observed} | {verdict} |\n"


def page() -> str:
    return HEAD + "".join(rows())


if __name__ == "__main__":
    sys.stdout.write(page())
