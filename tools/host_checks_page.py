"""Prints docs/host-checks.md from the modules of ``swarm_onboard.host_checks``."""

from __future__ import annotations

import sys
from collections.abc import Iterator

from swarmctl.health.host_checks import host_checks

HEAD = """\
# What status checks of a host itself

Each check is a module of `templates/onboard/swarm_onboard/host_checks/`, from which `make generated` writes
this page. The names are those in `swarmctl status --json`. A computer without the part in question, such as a
radio, has no such finding.

| check | observed | verdict |
|---|---|---|
"""


def rows() -> Iterator[str]:
    for name, check in host_checks().items():
        for observed, verdict in check.TABLE:
            yield f"| `{name}` | {observed} | {verdict} |\n"


def page() -> str:
    return HEAD + "".join(rows())


if __name__ == "__main__":
    sys.stdout.write(page())
