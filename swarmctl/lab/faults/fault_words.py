"""The words of ``lab fault`` without the spec, as a scenario file has them: ``unplug k3``."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from typing import Any

from swarmctl.lab.faults.fault_kind import FaultKind
from swarmctl.lab.faults.kinds import KINDS
from swarmctl.suggest import nearest


@dataclass(frozen=True)
class FaultWords:
    """A kind of fault, the selections of its targets, and the text and the value of its option."""

    kind: FaultKind
    selections: tuple[str, ...]
    text: str
    value: Any


def read(line: str) -> FaultWords:
    """Reads the words of a fault. Raises ``ValueError`` with what is wrong."""
    words = shlex.split(line)
    name = words[0] if words else ""
    if name not in KINDS:
        likely = nearest(name, KINDS)
        hint = f"did you mean `{likely}`?" if likely else f"the kinds are {', '.join(KINDS)}"
        raise ValueError(f"there is no fault `{name}`; {hint}")
    kind, targets, text = KINDS[name], [], None
    rest = iter(words[1:])
    for word in rest:
        option, equals, given = word.partition("=")
        if not word.startswith("--"):
            targets.append(word)
        elif kind.option is None or option != f"--{kind.option.name}":
            raise ValueError(f"`{name}` has no option {option}")
        else:
            text = given if equals else next(rest, "")
    if kind.option is not None and kind.option.needed and text is None:
        raise ValueError(f"`{name}` needs --{kind.option.name} {kind.option.metavar}")
    if not targets:
        raise ValueError(f"`{name}` needs a {'robot' if kind.of_robots else 'host'}: `{name} NAME`")
    return FaultWords(kind, tuple(targets), text or "", kind.read(text))
