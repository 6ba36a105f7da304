"""Rewrites the text of a spec into another mode, and changes only what the mode requires."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from swarmctl.links.bluetooth_link import Bluetooth
from swarmctl.mode_conversion.infer import Arrangement, arranged, moved_lines
from swarmctl.mode_conversion.text_editor import Change, TextEditor, removed, replaced, set_to
from swarmctl.spec.load import Document, load_text
from swarmctl.spec.model import Mode, Spec
from swarmctl.swarm.authority import OWN, Authority
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.modes import MULTIMASTER, ROLES
from swarmctl.yamltext.cst import lost_comments


def effects(before: SwarmIndex, after: SwarmIndex) -> Iterator[str]:
    """Yields what a reader of the new text cannot see in it, one sentence each."""
    yield from _masters(before, after)
    yield from _programs(before, after)
    yield from _commanders(before, after)
    if before.spec.islands and before.spec.islands != after.spec.islands:
        yield f"converting back does not restore the islands {_names(before.spec.islands)}"
    source, new = before.document.source, after.document.source
    for line, comment in lost_comments(source.text, new.text):
        yield f"{source.path}:{line}: the comment of a removed key is gone: {comment}"


def _masters(before: SwarmIndex, after: SwarmIndex) -> Iterator[str]:
    """The master of the one island, where there is one in both modes."""
    if len(before.islands) == len(after.islands) == 1 and before.islands[0].hub != after.islands[0].hub:
        yield f"the master runs on `{after.islands[0].hub}` instead of `{before.islands[0].hub}`"


def _programs(before: SwarmIndex, after: SwarmIndex) -> Iterator[str]:
    for name, program in before.spec.programs.items():
        old, new = before.program_hosts[name], after.program_hosts.get(name)
        if old == new or old is None or new is None:
            continue
        lacks = [need for need in program.needs if need not in after.spec.hosts[new].has]
        hint = f", which has no {_names(lacks)}" if lacks else ""
        yield f"program `{name}` runs on `{new}` instead of `{old}`{hint}"


def _commanders(before: SwarmIndex, after: SwarmIndex) -> Iterator[str]:
    """Who may command robots now and could not before, and the reverse: by commander, all its robots."""
    old, new = _commands(before), _commands(after)
    for (name, own), robots in new.items():
        gained = [robot for robot in robots if robot not in old.get((name, own), ())]
        if gained and own:
            yield f"the own programs of {_names(gained)} may command their robots"
        elif gained:
            yield f"`{name}` may command {_names(gained)}"
    for (name, own), robots in old.items():
        lost = [robot for robot in robots if robot not in new.get((name, own), ())]
        if lost and own:
            yield f"the own programs of {_names(lost)} may no longer command their robots"
        elif lost:
            yield f"`{name}` may no longer command {_names(lost)}"


def _commands(index: SwarmIndex) -> dict[tuple[str, bool], list[str]]:
    """The robots of every commander; those whose own programs command them are under ``("", True)``."""
    authority = Authority(index)
    found: dict[tuple[str, bool], list[str]] = {}
    for robot in index.spec.robots:
        for one in authority.over(robot):
            own = one.priority == OWN
            robots = found.setdefault(("" if own else one.name, own), [])
            if robot not in robots:
                robots.append(robot)
    return found


def _names(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


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
