"""Rewrites the text of a spec into another mode, and changes only what the mode requires."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from swarmctl.links.bluetooth_link import Bluetooth
from swarmctl.mode_conversion.arrangement import Arrangement, arranged, moved_lines
from swarmctl.mode_conversion.effects import effects
from swarmctl.mode_conversion.text_editor import Change, TextEditor, removed, replaced, set_to
from swarmctl.spec.load import Document, load_text
from swarmctl.spec.model import Mode, Spec
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.modes import MULTIMASTER, ROLES


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
    text = TextEditor(document.source)
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


def _mode_and_roles(text: TextEditor, spec: Spec, plan: Arrangement) -> None:
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


def _islands(text: TextEditor, spec: Spec, plan: Arrangement) -> None:
    if plan.islands and len(spec.islands) < 2:
        text.set((), "islands", _plain(plan.islands))
    elif spec.islands and not plan.islands:
        text.remove(("islands",))


def _placement(text: TextEditor, index: SwarmIndex, plan: Arrangement) -> None:
    """Moves lines, drivers and programs to the hosts that the mode requires."""
    spec, data = index.spec, text.source.data
    changes: list[Change] = []
    radios: dict[str, Change] = {}
    for number, link, host in moved_lines(index, plan):
        changes.append(replaced(("links", number, "host"), host))
        if not isinstance(link, Bluetooth):
            continue
        adapters = spec.hosts[host].bluetooth
        if not adapters and ("bluetooth" not in (data["hosts"][host] or {})):
            radios[host] = set_to(("hosts", host), "bluetooth", ["hci0"])
        if link.adapter is not None and link.adapter not in (adapters or ("hci0",)):
            changes.append(removed(("links", number, "adapter")))
    for name, robot in spec.robots.items():
        host = plan.driver_hosts.get(name, plan.hub)
        if robot.host is None and plan.mode is not Mode.SINGLE_MINDED:
            changes.append(set_to(("robots", name), "host", host))
        elif robot.host is not None and robot.host != host:
            changes.append(replaced(("robots", name, "host"), host))
    changes += [
        replaced(("programs", name, "host"), host)
        for name, host in plan.programs.items()
        if spec.programs[name].host != host
    ]
    text.change(*changes, *radios.values())


def _control(text: TextEditor, spec: Spec, plan: Arrangement) -> None:
    new = [{"by": entry.by, "of": list(entry.of)} for entry in plan.control]
    if new and not spec.control:
        text.set((), "control", new)
    else:
        for entry in new:
            text.append(("control",), entry)


def _clock(text: TextEditor, index: SwarmIndex, plan: Arrangement) -> None:
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


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(one) for key, one in value.items()}
    return [_plain(one) for one in value] if isinstance(value, (list, tuple)) else value
