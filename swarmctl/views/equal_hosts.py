"""Finds hosts that differ only in names, addresses and measured numbers, and writes them as one text."""

from __future__ import annotations

import re
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from string import ascii_letters, digits
from typing import TypeVar

from rich.text import Text

from swarmctl.swarm.resolved import Swarm
from swarmctl.views.escape import printable
from swarmctl.views.width import wrapped
from swarmctl.yamltext import hostlist

FEW = 3  # equal hosts that are still shown one by one
LONGEST_LIST = 40  # letters of a list of names within a sentence
_Item = TypeVar("_Item")

# Marks in the place of names and numbers; no text for a terminal has private characters of Unicode.
_HOST, _ADDRESS, _NUMBER, _RELEASE, _ROBOTS = "\ue000", "\ue001", "\ue002", "\ue003", 0xE010
_MARK = re.compile("[\ue000-\uf8ff]")
# Both begin with a character that they take, and look behind it then: so a search skips all other places.
_MEASURED = re.compile(r"\d(?:(?<![\w.]\d)\d*\.\d+(?!\.?\d)|(?<![\w.-]\d)\d*(?= (?:s|times|ms)\b))")
_DIGEST = re.compile(r"[0-9a-f](?<!\w.)[0-9a-f]{15}\b")
_LETTERS = frozenset(ascii_letters + digits)


@dataclass(frozen=True)
class Names:
    """The names of one host: its own, its address, those of its robots and their namespaces.

    ``kind`` differs if hosts do.
    """

    host: str
    address: str = ""
    robots: tuple[str, ...] = ()
    namespaces: tuple[str, ...] = ()  # of these robots, without the leading slash
    kind: str = ""

    @cached_property
    def _marks(self) -> dict[str, str]:
        robots = {name: chr(_ROBOTS + number) for number, name in enumerate(self.robots)}
        namespaces = dict(zip(self.namespaces, robots.values(), strict=False))
        return {**namespaces, **robots, self.address: _ADDRESS, self.host: _HOST}

    def _in(self, text: str) -> Iterator[tuple[int, str]]:
        """Yields where a name stands in ``text``, and the name; no letter or digit is beside it.

        A regular expression of the names would find the same; to compile one for each host takes much longer.
        """
        found, end = list[tuple[int, int, str]](), 0
        for name in filter(None, self._marks):
            start = text.find(name)
            while start >= 0:
                stop = start + len(name)
                if text[start - 1 : start] not in _LETTERS and text[stop : stop + 1] not in _LETTERS:
                    found.append((start, -stop, name))
                start = text.find(name, start + 1)
        for start, stop, name in sorted(found):  # of several at one place the longest
            if start >= end:
                yield start, name
                end = -stop

    def _marked(self, text: str) -> str:
        parts, end = list[str](), 0
        for start, name in self._in(text):
            parts += text[end:start], self._marks[name]
            end = start + len(name)
        return "".join((*parts, text[end:]))

    def about(self, text: str) -> Names:
        """Returns these names with that robot only which ``text`` names, if it names one."""
        pattern = self.pattern_of(text)
        places = [place for place in range(len(self.robots)) if chr(_ROBOTS + place) in pattern]
        if len(places) != 1:
            return self
        one = slice(places[0], places[0] + 1)
        return replace(self, robots=self.robots[one], namespaces=self.namespaces[one])

    def pattern_of(self, text: str) -> str:
        """Returns ``text`` with marks for names and numbers; equal for texts that differ only in these."""
        return _without_numbers(_DIGEST.sub(_RELEASE, self._marked(text)))

    def behind(self, text: str, *, one: bool = False) -> str:
        """Returns a message that stands behind the name of its host, or of several, without repeating it.

        ``pi (10.0.0.1, port 22) is off`` becomes ``each (port 22) is off`` behind several names.
        """
        rest = text.removeprefix(self.host)
        if rest.startswith(": "):
            return rest[2:]
        if one or rest == text or not rest.startswith(" "):
            return text
        for address in (f" ({self.address})", f" ({self.address}, "):
            if self.address and rest.startswith(address):
                return "each" + rest.replace(address, " (" if address.endswith(" ") else "", 1)
        return f"each{rest}"

    def values_in(self, text: str) -> list[str]:
        """Returns the names and numbers in ``text`` that marks replace."""
        named = self._marked(text)
        names = (name for _, name in self._in(text))
        released = _DIGEST.sub(_RELEASE, named)
        others = {_NUMBER: iter(_MEASURED.findall(released)), _RELEASE: iter(_DIGEST.findall(named))}
        marked = _MEASURED.sub(_NUMBER, released)
        return [next(others.get(mark, names)) for mark in _MARK.findall(marked)]


@lru_cache(maxsize=64)
def _without_numbers(text: str) -> str:
    """Returns ``text`` with marks for measured numbers; most hosts have the same text by now."""
    return _MEASURED.sub(_NUMBER, text)


def names_of(swarm: Swarm) -> Mapping[str, Names]:
    """Returns what equal hosts may differ in; hosts with robots of other types are not equal."""
    on = {name: swarm.robots_on(name) for name in swarm.hosts}
    return {
        name: Names(
            name,
            host.address,
            tuple(robot.name for robot in on[name]),
            tuple(robot.namespace[1:] for robot in on[name]),
            kind=" ".join(robot.type_name for robot in on[name]),
        )
        for name, host in swarm.hosts.items()
    }


def grouped(
    items: Iterable[_Item],
    key: Callable[[_Item], Hashable],
    alone: Callable[[list[_Item]], bool] | None = None,
) -> list[list[_Item]]:
    """Returns the items in groups of equal keys, in the order of their first.

    The items of a group that is to stay ``alone`` are groups of one each.
    """
    found: dict[Hashable, list[_Item]] = {}
    kept = list(items)
    lists = [found.setdefault(key(item), []) for item in kept]
    for item, group in zip(kept, lists, strict=True):
        group.append(item)
    groups = []
    for item, group in zip(kept, lists, strict=True):
        if alone is not None and alone(group):
            groups.append([item])
        elif group[0] is item:
            groups.append(group)
    return groups


def merged(texts: Sequence[str], names: Sequence[Names]) -> str:
    """Returns texts of one pattern as one: names as ranges, numbers from the least to the greatest.

    If names are no single short range, the first text and how many more there are.
    """
    together = in_ranges(texts, names)
    return f"{texts[0]}, and {len(texts) - 1} more" if together is None else together


def merged_behind(texts: Sequence[str], names: Sequence[Names]) -> str:
    """Returns what ``merged`` does, for a text that stands behind the names of its hosts."""
    one = len(texts) == 1
    return merged([own.behind(text, one=one) for own, text in zip(names, texts, strict=True)], names)


def in_ranges(texts: Sequence[str], names: Sequence[Names]) -> str | None:
    """Returns texts of one pattern as one, with ranges; None if names are no single short range."""
    if len(set(texts)) == 1:
        return texts[0]
    pattern = names[0].pattern_of(texts[0])
    columns = zip(*(own.values_in(text) for own, text in zip(names, texts, strict=True)), strict=True)
    ranges = [_together(mark, values) for mark, values in zip(_MARK.findall(pattern), columns, strict=True)]
    if None in ranges:
        return None
    left = iter(ranges)
    return _MARK.sub(lambda _: next(left) or "", pattern)


def _together(mark: str, values: Sequence[str]) -> str | None:
    if len(set(values)) == 1:
        return values[0]
    if mark == _NUMBER:
        least, *_, greatest = sorted(values, key=float)
        return f"{least}-{greatest}"
    listed = hostlist.written(values)
    return None if mark == _RELEASE or ", " in listed or len(listed) > LONGEST_LIST else listed


def notes(
    noted: Sequence[tuple[str, str]],
    names: Mapping[str, Names],
    *,
    details: bool,
    width: int | None,
    complete: Callable[[str], str],
) -> Text:
    """One line for equal notes of ``(host, note)``, which may differ in names; with ``details`` for each."""
    texts = [(host, printable(complete(note))) for host, note in noted]
    rows = [(host, (names.get(host) or Names(host)).about(text), text) for host, text in texts]
    text = Text()
    for group in grouped(rows, lambda row: (row[0], row[2]) if details else row[1].pattern_of(row[2])):
        hosts, own, same = zip(*group, strict=True)
        line = Text(f"note: {hostlist.written(hosts)}: {merged(same, own)}", "dim")
        text.append_text(wrapped(line, width, 6)).append("\n")
    return text
