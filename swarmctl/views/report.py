"""The README of a report's archive."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

_FILES = """\
status.json     the health of the swarm, as `swarmctl status --json` prints it
look.json       when that was seen, and how the spec was named
plan.json       what a deploy would do, as `swarmctl plan --json` prints it
logs.jsonl      the last lines of each host, as `swarmctl logs --json` prints them
edits/          files that were edited on hosts and that a deploy would replace, as they are there
history.json    the runs that changed the hosts
graph.svg/json  the swarm as a graph
motion.json     topics on how robots move, and their start poses
versions.json   swarmctl, Python, libraries
effective.yaml  the effective spec; spec/ has its files
"""


def readme(swarm: str, when: str, missing: Mapping[str, str], unknown: Iterable[str]) -> str:
    """What the files are; the hosts of which a part is missing; secrets whose values are not ``known``."""
    hosts = "".join(f"missing: {name}: {why}\n" for name, why in missing.items())
    return (
        f"Report of the swarm {swarm}, {when}. `swarmctl status --from ARCHIVE` shows its health.\n\n"
        f"{_FILES}\n{hosts}{secrets(unknown)}\n"
    )


def secrets(unknown: Iterable[str]) -> str:
    """Which secrets were removed, in one line."""
    names = ", ".join(unknown)
    left = f"; not known here, so not looked for: {names}" if names else ""
    return f"Values of secrets are replaced by their names{left}."
