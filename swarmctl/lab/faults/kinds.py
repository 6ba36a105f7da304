"""The kinds of faults, in the order in which they are ended: a host that is off is started first."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from swarmctl.lab.faults import host_faults, robot_faults
from swarmctl.lab.faults.fault_kind import FaultKind, RunningLab

KINDS: dict[str, FaultKind] = {
    kind.name: kind
    for kind in (
        host_faults.POWER_OFF,
        host_faults.REBOOT,
        host_faults.LINK_DOWN,
        host_faults.BANDWIDTH,
        host_faults.LOSS,
        host_faults.NO_MULTICAST,
        host_faults.CLOCK,
        host_faults.DISK_FULL,
        host_faults.READ_ONLY,
        robot_faults.UNPLUG,
        robot_faults.STALL,
        robot_faults.BATTERY,
        robot_faults.KILL,
    )
}


def end_all(lab: RunningLab, hosts: Sequence[str], robots: Sequence[str]) -> None:
    """Ends every fault of hosts and robots; does nothing where there is none. Raises ``LabError``."""
    for end, of_robots in dict.fromkeys((kind.end, kind.of_robots) for kind in KINDS.values()):
        end(lab, robots if of_robots else hosts)


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
        from swarmctl.suggest import nearest  # noqa: PLC0415  the help needs none of it

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
