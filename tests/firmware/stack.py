"""The most stack that an AVR program can need: an upper bound out of its disassembly, interrupts included."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass, field

_RETURN = 2  # bytes, the address that a call leaves
_LABEL = re.compile(r"^([0-9a-f]{8}) <(.+)>:$")
_LINE = re.compile(r"^\s+([0-9a-f]+):\t(\S+)(?:\s+([^;]*?))?\s*(?:;\s*0x([0-9a-f]+).*|;.*)?$")
_ENDS = ("ret", "reti", "jmp", "rjmp", "ijmp")
_INTERRUPT = re.compile(r"__vector_\d+")


@dataclass
class _Function:
    name: str
    frame: int = 0  # bytes that it pushes and reserves
    calls: set[int] = field(default_factory=set)  # addresses; what is jumped to needs no return address
    jumps: set[int] = field(default_factory=set)
    calls_any: bool = False  # through a pointer
    ends: bool = False


def deepest(disassembly: str) -> int:
    """The most stack in bytes. Counts every call path, also impossible ones; a function pointer may call
    any function that is never called by name. One interrupt is added: they do not nest.
    """
    functions = _functions(disassembly.splitlines())
    starts = sorted(functions)
    called = {_at(starts, address) for one in functions.values() for address in one.calls}
    interrupts = [start for start, one in functions.items() if _INTERRUPT.fullmatch(one.name)]
    main = next(start for start, one in functions.items() if one.name == "main")
    nameless = [start for start in functions if start not in (called | {*interrupts, main})]
    known: dict[int, int] = {}

    def depth(start: int, path: frozenset[int]) -> int:
        if start in path:  # a loop of jumps; these programs do not recurse
            return 0
        if start not in known:
            one, within = functions[start], path | {start}
            deeper = [_RETURN + depth(_at(starts, address), within) for address in one.calls]
            deeper += [depth(_at(starts, address), within) for address in one.jumps]
            if one.calls_any:
                deeper += [_RETURN + depth(other, within) for other in nameless]
            known[start] = one.frame + max(deeper, default=0)
        return known[start]

    interrupted = max((_RETURN + depth(start, frozenset()) for start in interrupts), default=0)
    return _RETURN + depth(main, frozenset()) + interrupted


def _at(starts: list[int], address: int) -> int:
    return starts[bisect_right(starts, address) - 1]


def _functions(lines: Iterable[str]) -> dict[int, _Function]:
    found: dict[int, _Function] = {}
    current, before = _Function(""), ""
    for line in lines:
        if label := _LABEL.match(line):
            start = int(label[1], 16)
            if not current.ends:
                current.jumps.add(start)  # it runs on into the next one
            current = found[start] = _Function(label[2])
        elif instruction := _LINE.match(line):
            _, name, operands, target = instruction.groups()
            _take(current, name, operands or "", target, before)
            before = name
    for start, one in found.items():
        one.jumps = {target for target in one.jumps if _at(sorted(found), target) != start}
    return found


def _take(current: _Function, name: str, operands: str, target: str | None, before: str) -> None:
    current.ends = name in _ENDS
    if name == "push":
        current.frame += 1
    elif name == "rcall" and operands == ".+0":
        current.frame += _RETURN  # a short way to reserve two bytes
    elif name in ("sbiw", "subi") and operands.startswith("r28,") and before == "in":
        current.frame += int(operands.split(",")[1], 16)
    elif name == "sbci" and operands.startswith("r29,") and before == "subi":
        current.frame += int(operands.split(",")[1], 16) << 8
    elif name in ("call", "rcall") and target:
        current.calls.add(int(target, 16))
    elif name == "icall":
        current.calls_any = True
    elif target and (name in ("jmp", "rjmp") or name.startswith("br")):
        current.jumps.add(int(target, 16))
