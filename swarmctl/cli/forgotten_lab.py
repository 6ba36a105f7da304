"""Guesses that ``--lab`` was forgotten: the hosts do not answer, and a lab of their swarm runs here."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from swarmctl.cli import console
from swarmctl.cli.where import Where

_ABSENT = ("unreachable", "host-key")  # kinds of errors of hosts that exist only in a lab


def guess(verb: str, where: Where, swarm: str, kinds: Iterable[str]) -> None:
    """Print the command with ``--lab`` if errors of these ``kinds`` may come from its absence."""
    if not any(kind in _ABSENT for kind in kinds):
        return
    for name in _running(swarm):
        there = replace(where, lab=True, lab_name="" if name == swarm else name, executor="")
        command = there.command(verb)
        console.err().print(f"the lab {name} of this swarm runs on this machine; its hosts: `{command}`")


def _running(swarm: str) -> list[str]:
    """The names of running labs of the swarm."""
    from swarmctl.lab import paths, supervisor_client
    from swarmctl.lab.errors import LabError
    from swarmctl.lab.lab_state import read_state

    def belongs(files: paths.LabPaths) -> bool:
        try:
            return read_state(files).plan.swarm == swarm and supervisor_client.status(files) is not None
        except (LabError, OSError):  # one of another account, or one that was never up
            return False

    return [files.name for files in paths.all_labs() if belongs(files)]
