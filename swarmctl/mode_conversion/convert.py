"""Rewrites the text of a spec into another mode, and changes only what the mode requires."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from swarmctl.links.bluetooth_link import Bluetooth
from swarmctl.mode_conversion.arrangement import Arrangement, arranged, moved_lines
from swarmctl.mode_conversion.effects import effects
from swarmctl.spec.load import Document, load_text, source_of_text
from swarmctl.spec.model import Mode, Spec
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.modes import MULTIMASTER, ROLES
from swarmctl.yamltext import edits
from swarmctl.yamltext.edits import Edits
from swarmctl.yamltext.source import Loc, Source

Change = tuple[str, Callable[[Source], Edits]]  # its title, and the edits that it takes


@dataclass(frozen=True)
class Conversion:
    """The new text, the changes in it, the steps left to a person, and changes that were not possible.

    ``notes`` are what a reader of the changes has to know.
    """

    text: str
    changes: tuple[str, ...]
    by_hand: tuple[str, ...]
    undone: tuple[str, ...]
    notes: tuple[str, ...]


def converted(document: Document, mode: Mode) -> Conversion:
    """``document`` in ``mode``. Raises ArrangementError if the swarm lacks the hosts for it."""
    index = SwarmIndex(document)
    spec, plan = index.spec, arranged(index, mode)
    text = _TextEditor(document.source)
    _mode_and_roles(text, spec, plan)
    _islands(text, spec, plan)
    _placement(text, index, plan)
    _control(text, spec, plan)
    _clock(text, index, plan)
    after, _ = load_text(text.source.text, document.source.path, document.catalog)
    changed = effects(index, SwarmIndex(after)) if after is not None else ()
    return Conversion(
        text.source.text,
        tuple(text.done),
        tuple(_by_hand(index, plan)),
        tuple(text.undone),
        (*_notes(spec, plan), *changed),
    )


class _TextEditor:
    """Edits the text of a spec, and parses it again after every change."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.done: list[str] = []
        self.undone: list[str] = []

    def change(self, *changes: Change) -> None:
        """Makes changes together, so that all elements of a range may change as one."""
        made = [make(self.source) for _, make in changes]
        whole = {replace(edit, copies=1) for edit in edits.joined(made) if edit.copies == 1}
        possible: list[Edits] = []
        for (title, _), part in zip(changes, made, strict=True):
            own = {replace(edit, copies=1) for edit in part}
            if own and own <= whole and {edit.span.file for edit in own} == {self.source.path}:
                possible.append(part)
                self.done.append(title)
            else:  # in a range of which the other elements do not change alike, or in another file
                self.undone.append(title)
        if possible:
            text = edits.apply(self.source.text, edits.joined(possible))
            self.source = source_of_text(text, self.source.path)

    def replace(self, loc: Loc, value: Any) -> None:
        self.change(_replaced(loc, value))

    def set(self, loc: Loc, key: str, value: Any, after: str = "") -> None:
        self.change(_set(loc, key, value, after))

    def remove(self, loc: Loc) -> None:
        self.change(_removed(loc))

    def rename(self, loc: Loc, key: str) -> None:
        self.change((f"{_path(loc)} renamed to {key}", lambda now: edits.rename_key(now, loc, key)))

    def append(self, loc: Loc, value: Any) -> None:
        title = f"{_path(loc)}: {_shown(value)} added"
        self.change((title, lambda now: edits.append_item(now, loc, value)))


def _replaced(loc: Loc, value: Any) -> Change:
    return f"{_path(loc)}: {_shown(value)}", lambda now: edits.replace_value(now, loc, value)


def _set(loc: Loc, key: str, value: Any, after: str = "") -> Change:
    title = f"{_path((*loc, key))}: {_shown(value)}"
    return title, lambda now: edits.set_key(now, loc, key, value, after=after)


def _removed(loc: Loc) -> Change:
    return f"{_path(loc)} removed", lambda now: edits.remove(now, loc)


def _mode_and_roles(text: _TextEditor, spec: Spec, plan: Arrangement) -> None:
    if spec.mode is not plan.mode:
        text.replace(("mode",), plan.mode.value)
    role = ROLES.get(plan.mode)
    wanted = role.key if role else None
    present = [key for key in ("leader", "hub") if getattr(spec, key) is not None]
    for key in present:
        if key != wanted and wanted is not None and wanted not in present:
            text.rename((key,), wanted)
            if getattr(spec, key) != plan.hub:
                text.replace((wanted,), plan.hub)
            return
        if key != wanted:
            text.remove((key,))
    if wanted is None:
        return
    if wanted not in present:
        text.set((), wanted, plan.hub, after="mode")
    elif getattr(spec, wanted) != plan.hub:
        text.replace((wanted,), plan.hub)


def _islands(text: _TextEditor, spec: Spec, plan: Arrangement) -> None:
    if plan.islands and len(spec.islands) < 2:
        text.set((), "islands", _plain(plan.islands))
    elif spec.islands and not plan.islands:
        text.remove(("islands",))


def _placement(text: _TextEditor, index: SwarmIndex, plan: Arrangement) -> None:
    """Moves lines, drivers and programs to the hosts that the mode requires."""
    spec, data = index.spec, text.source.data
    changes: list[Change] = []
    radios: dict[str, Change] = {}
    for number, link, host in moved_lines(index, plan):
        changes.append(_replaced(("links", number, "host"), host))
        if not isinstance(link, Bluetooth):
            continue
        adapters = spec.hosts[host].bluetooth
        if not adapters and ("bluetooth" not in (data["hosts"][host] or {})):
            radios[host] = _set(("hosts", host), "bluetooth", ["hci0"])
        if link.adapter is not None and link.adapter not in (adapters or ("hci0",)):
            changes.append(_removed(("links", number, "adapter")))
    for name, robot in spec.robots.items():
        host = plan.driver_hosts.get(name, plan.hub)
        if robot.host is None and plan.mode is not Mode.SINGLE_MINDED:
            changes.append(_set(("robots", name), "host", host))
        elif robot.host is not None and robot.host != host:
            changes.append(_replaced(("robots", name, "host"), host))
    changes += [
        _replaced(("programs", name, "host"), host)
        for name, host in plan.programs.items()
        if spec.programs[name].host != host
    ]
    text.change(*changes, *radios.values())


def _control(text: _TextEditor, spec: Spec, plan: Arrangement) -> None:
    new = [{"by": entry.by, "of": list(entry.of)} for entry in plan.control]
    if new and not spec.control:
        text.set((), "control", new)
    else:
        for entry in new:
            text.append(("control",), entry)


def _clock(text: _TextEditor, index: SwarmIndex, plan: Arrangement) -> None:
    """Declares a time root if a host has no clock of its own: with several masters there is no default."""
    spec, computers = index.spec, index.computers
    kinds = {index.computer_of(host) for host in spec.hosts}
    without = any(kind in computers and not computers[kind].clock for kind in kinds if kind)
    if plan.mode not in MULTIMASTER or spec.time.root is not None or not without:
        return
    if "time" in spec.model_fields_set:
        text.set(("time",), "root", plan.hub)
    else:
        text.set((), "time", {"root": plan.hub})


def _by_hand(index: SwarmIndex, plan: Arrangement) -> list[str]:
    """The steps left to a person: cables and dongles to move, robots to pair, networks to join."""
    return [link.moving(host) for _, link, host in moved_lines(index, plan)]


def _notes(spec: Spec, plan: Arrangement) -> Iterator[str]:
    for entry in plan.control:
        robots = "`, `".join(entry.of)
        yield f"new in `control`: `{entry.by}` commands `{robots}`, as it did without an entry"
    if spec.multimaster is not None and plan.mode not in MULTIMASTER:
        yield f"`multimaster` stays for the way back; in mode `{plan.mode.value}` it has no effect"


def _path(loc: Loc) -> str:
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in loc).lstrip(".")


def _shown(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {_shown(one)}" for key, one in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_shown, value)) + "]"
    return str(value)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(one) for key, one in value.items()}
    return [_plain(one) for one in value] if isinstance(value, (list, tuple)) else value
