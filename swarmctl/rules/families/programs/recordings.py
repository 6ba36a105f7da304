"""Bags that a program records: what a restart of its unit does to them."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic
from swarmctl.rules.context import RuleContext, rule
from swarmctl.swarm.recordings import record_words

_NAMES = ("-O", "--output-name")


@rule("PROG033", ros1=True)
def fixed_bags(context: RuleContext) -> Iterator[Diagnostic]:
    """A bag whose name is the same after a restart; a person who starts the program chooses when."""
    for name, program in context.spec.programs.items():
        key, words = record_words(program)
        at = next((at for at, word in enumerate(words) if _names_a_bag(word)), None)
        if at is None or program.lifecycle == "interactive":
            continue
        yield Diagnostic(
            "PROG033",
            f"each restart of program `{name}` overwrites its bag",
            context.span("programs", name, key, at),
            label="the bag always has this name",
            help=("write -o and a prefix: rosbag appends date, time and `.bag` to it",),
        )


def _names_a_bag(word: str) -> bool:
    return word in _NAMES or word.startswith(("--output-name=", "-O"))
