"""The command that usually comes next, as the last line of a verb on a terminal."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

from swarmctl.cli import console
from swarmctl.cli.spec_args import SpecFiles

if TYPE_CHECKING:
    pass


def advise(verb: str, spec: SpecFiles, *more: str) -> None:
    """Print ``next: swarmctl VERB SPEC MORE``. Scripts, which have no terminal as stdout, see nothing."""
    console.show_next(spec.command(verb, *fitting(verb, more)))


def fitting(verb: str, where: Sequence[str]) -> list[str]:
    """The options in ``where`` that ``verb`` has."""
    if verb in _SPREAD or "--executor" not in where:
        return list(where)
    at = where.index("--executor")
    return [*where[:at], *where[at + 2 :]]


#: Verbs that have `--executor`.
_SPREAD = ("adopt", "deploy", "exporter", "plan", "remove", "rollback", "status")
_HINTED = re.compile(
    r"\bswarmctl (adopt|deploy|keys|plan|prepare|record|remove|start|status|trust)\b(?: SPEC\b)?"
)


def completing(spec: SpecFiles, where: Sequence[str]) -> Callable[[str], str]:
    """Returns a function that completes the commands in a hint, so that they can be typed.

    ``swarmctl trust SPEC`` becomes ``swarmctl trust lab/swarm.yaml --lab``; ``where`` chooses the hosts.
    """

    def command(found: re.Match[str]) -> str:
        if found[1] == "keys":  # of the whole swarm
            return spec.command(found[1])
        if found[1] in ("start", "trust"):  # the robots follow; of the whole swarm
            fit = fitting(found[1], where)
            return spec.command(found[1], *fit[: fit.index("--limit") if "--limit" in fit else None])
        return spec.command(found[1], *fitting(found[1], where))

    return lambda hint: _HINTED.sub(command, hint)


def in_lab_errors(lines: Iterable[str], spec: SpecFiles, name: str = "") -> list[str]:
    """Help of the lab, in which ``lab up`` has the spec and the name of the lab."""
    booting = spec.command("lab up", *(["--name", name] if name else []))
    return [line.replace("`swarmctl lab up`", f"`{booting}`") for line in lines]


def selection(hosts: Iterable[str]) -> str:
    """The hosts as one value of ``--limit``."""
    from swarmctl.yamltext import hostlist

    return ",".join(text for text, _ in hostlist.ranges_of(hosts))
