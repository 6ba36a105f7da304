"""Exchanges two robots of a swarm: what belongs to the device moves, what belongs to its role stays. Pure.

To the device belong its addresses (MAC with PIN and channel, USB adapter, IP address, radio address), its
calibration and the wiring of its board, and the computer that it carries or is wired to. To the role belong
name, namespace, labels, start pose, rates, limits, and every reference to the name.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from swarmctl.diagnostics import Edit
from swarmctl.plugins import LINK_KINDS
from swarmctl.spec.load import Document
from swarmctl.suggest import did_you_mean
from swarmctl.yamltext import edits
from swarmctl.yamltext.source import Loc, Source

_MEASURED = ("calibration", "firmware")  # of the settings


class SwapError(ValueError):
    """Two robots that cannot be exchanged: the reason, and what helps."""


@dataclass(frozen=True)
class Swap:
    """The edits, by file, and what moves, such as `mac`."""

    edits: Mapping[str, tuple[Edit, ...]]
    moved: tuple[str, ...]


def swap(document: Document, robot: str, other: str) -> Swap:
    """Returns the edits that give ``robot`` the device of ``other``, and the other way round.

    Raises ``SwapError``.
    """
    _check(document, robot, other)
    source = document.source
    parts: list[edits.Edits] = []
    moved: list[str] = []
    for one, two, key in _identity(document, robot, other):
        found = list(_exchanged(source, one, two, key))
        if not all(found):
            places = [(*loc, *key.split(".")) for loc in (one, two)]
            span = source.span(next(loc for loc in places if _get(source, loc) is not None))
            raise SwapError(
                f"{span.file}:{span.line}:{span.column}: `{key}` cannot be exchanged in the text",
                "an alias, a variable or one text for several entries has it: write it for each robot",
            )
        if found:
            parts += found
            moved.append(key)
    joined = edits.joined(parts)
    if parts and not joined:
        raise SwapError(
            f"several keys of `{robot}` and `{other}` cannot be exchanged in one line of the text",
            "write each key of their links on a line of its own",
        )
    if shared := [edit for edit in joined if edit.copies > 1]:
        raise SwapError(
            f"{shared[0].span.file}:{shared[0].span.line}:{shared[0].span.column}: this is written for other "
            "robots, too",
            "write what belongs to one robot for each: `swarmctl spec --expanded`",
        )
    if not moved:
        raise SwapError(f"the spec says nothing of `{robot}` and `{other}` in which their devices differ")
    by_file: dict[str, tuple[Edit, ...]] = {}
    for edit in joined:
        by_file[edit.span.file] = (*by_file.get(edit.span.file, ()), edit)
    return Swap(by_file, tuple(dict.fromkeys(moved)))


def _check(document: Document, robot: str, other: str) -> None:
    robots = document.spec.robots
    for name in (robot, other):
        if name not in robots:
            raise SwapError(
                f"there is no robot `{name}`", *did_you_mean(name, list(robots), "the robots are")
            )
    if robot == other:
        raise SwapError(f"`{robot}` is to be exchanged with itself", "name the robot that takes its place")
    types = robots[robot].type, robots[other].type
    if types[0] != types[1]:
        raise SwapError(
            f"`{robot}` is of type `{types[0]}`, and `{other}` of type `{types[1]}`",
            "only robots of one type can take each other's place",
        )
    kinds = [document.source.data["links"][link]["kind"] if link is not None else "no link"
             for link in (_link(document, robot), _link(document, other))]  # fmt: skip
    if kinds[0] != kinds[1]:
        raise SwapError(
            f"`{robot}` is connected by {kinds[0]}, and `{other}` by {kinds[1]}",
            "only robots with links of one kind can take each other's place",
        )


def _link(document: Document, robot: str) -> int | None:
    """The index of the link of ``robot``."""
    links = enumerate(document.spec.links)
    return next((number for number, link in links if getattr(link, "robot", None) == robot), None)


def _identity(document: Document, robot: str, other: str) -> Iterator[tuple[Loc, Loc, str]]:
    """Yields what belongs to the devices: two mappings, and a key of these."""
    entries: tuple[Loc, Loc] = (("robots", robot), ("robots", other))
    one, two = _link(document, robot), _link(document, other)
    if one is None or two is None:
        yield (*entries, "host")  # it has a computer of its own
    else:
        first, second = (document.source.data["links"][number] for number in (one, two))
        places: tuple[Loc, Loc] = (("links", one), ("links", two))
        kind = LINK_KINDS.get(first["kind"])
        if kind.wired and first["host"] != second["host"]:
            yield (*places, "host")  # it is wired to it
            yield (*entries, "host")
        for key in kind.device_keys:
            yield (*places, key)
    for key in _MEASURED:
        yield (*entries, f"settings.{key}")


def _exchanged(source: Source, one: Loc, two: Loc, key: str) -> Iterator[edits.Edits]:
    """Yields the edits that exchange a value, or move the one that there is; an empty one is impossible."""
    head, _, rest = key.partition(".")
    first, second = _get(source, (*one, *key.split("."))), _get(source, (*two, *key.split(".")))
    if first == second:
        return
    if first is not None and second is not None:
        yield from _both(source, (*one, *key.split(".")), (*two, *key.split(".")), first, second)
        return
    (origin, value), target = ((one, first), two) if second is None else ((two, second), one)
    if not rest:
        yield edits.remove(source, (*origin, key))
        yield edits.set_key(source, target, key, _plain(value))
        return
    alone = len(_get(source, (*origin, head))) == 1  # nothing else is left of the mapping
    yield edits.remove(source, (*origin, head) if alone else (*origin, head, rest))
    if _get(source, (*target, head)) is None:
        yield edits.set_key(source, target, head, {rest: _plain(value)})
    else:
        yield edits.set_key(source, (*target, head), rest, _plain(value))


def _both(source: Source, one: Loc, two: Loc, first: Any, second: Any) -> Iterator[edits.Edits]:
    """Yields the edits that exchange two different values: of mappings with the same keys, key by key."""
    if isinstance(first, dict) and isinstance(second, dict) and first.keys() == second.keys():
        for key in first:
            if first[key] != second[key]:
                yield from _both(source, (*one, key), (*two, key), first[key], second[key])
    elif one[-1] == "uri" and _dongle(first) != _dongle(second):  # the dongle belongs to the host
        yield edits.replace_value(source, one, second.replace(_dongle(second), _dongle(first), 1))
        yield edits.replace_value(source, two, first.replace(_dongle(first), _dongle(second), 1))
    else:
        yield edits.exchange(source, one, two, _plain(first), _plain(second))


def _dongle(uri: str) -> str:
    """The beginning of a radio's URI, with the number of the dongle."""
    return "/".join(uri.split("/")[:3])


def _get(source: Source, loc: Loc) -> Any:
    """The value at ``loc``; None if there is none."""
    value: Any = source.data
    for step in loc:
        if isinstance(value, dict):
            value = value.get(step)
        elif isinstance(value, (list, tuple)) and isinstance(step, int):
            value = value[step]
        else:
            return None
    return value


def _plain(value: Any) -> Any:
    """The same with lists for tuples, as the writer of YAML takes them."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    return [_plain(one) for one in value] if isinstance(value, tuple) else value
