"""What a selection means in one swarm: its hosts or its robots. Its grammar is in `yamltext.selection_text`.

Where hosts are selected, a robot or program means its host; where robots are, a host means its robots.
"""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from swarmctl.spec.selection_candidates import Candidates, Kind
from swarmctl.suggest import did_you_mean, nearest
from swarmctl.yamltext.selection_text import (
    PREFIXES,
    Both,
    Either,
    Part,
    SelectionError,
    Without,
    Word,
    is_glob,
    is_selection,
    parse,
)

_WHAT = {
    "": ("no host or robot called", "hosts and robots"),
    "host": ("no host called", "the hosts are"),
    "robot": ("no robot called", "the robots are"),
    "program": ("no program called", "the programs are"),
    "type": ("no robot of the type", "the types of its robots are"),
    "@": ("no group or label called", "groups and labels"),
    "island": ("no island called", "the islands are"),
    "mode": ("no island in mode", "the modes are"),
}
_ELSEWHERE = ("program", "@", "island", "type", "mode", "host", "robot")


def with_prefix(prefix: str, name: str) -> str:
    """Returns a name as a selection has it: ``@lab``, ``type:epuck2``, ``k3``."""
    return f"{prefix}{':' if prefix not in ('', '@') else ''}{name}"


def unknown_name(candidates: Candidates, word: Word, name: str) -> SelectionError:
    """Returns the error about a name that does not exist, with the prefix under which it does."""
    what, known = _WHAT[word.prefix]
    help_lines: tuple[str, ...]
    meant = ""
    if (prefix := next((one for one in _ELSEWHERE if name in candidates.named(one)), None)) is not None:
        meant = with_prefix(prefix, name)
        help_lines = (f"write `{meant}`",)
    elif name == "all":
        meant = "*"
        help_lines = ("write `*` for everything",)
    elif not word.prefix and name[:1] == "-" and name[1:] in candidates.hosts_and_robots:
        meant = f"!{name[1:]}"
        help_lines = (f"write `{meant}` to leave it out",)
    else:
        words = [with_prefix(word.prefix, one) for one in candidates.named(word.prefix)]
        help_lines = did_you_mean(with_prefix(word.prefix, name), words, known)
        meant = nearest(with_prefix(word.prefix, name), words) or ""
    error = SelectionError(f"there is {what} `{name}`", word.start, word.end, *help_lines, code="SEL002")
    error.meant = meant if len(word.names) == 1 else ""
    return error


def words_for(candidates: Candidates, begun: str) -> list[str]:
    """Returns words that may be meant by the beginning of one: names, then sets; other prefixes if begun."""
    usual = ("", "@", "island", "type")
    prefixes = [one for one in PREFIXES if begun.startswith(f"{one}:")] or usual
    return [with_prefix(prefix, name) for prefix in prefixes for name in candidates.named(prefix)]


def selects_nothing(
    candidates: Candidates, kind: Kind, texts: Sequence[str], idle: Collection[str]
) -> SelectionError:
    """Returns the error about selections that mean no host or no robot; ``idle`` are words without any."""
    what, shown = kind.removesuffix("s"), ",".join(texts)
    words = " and ".join(f"`{one}`" for one in idle)
    means = "means" if len(idle) == 1 else "mean"
    error = SelectionError(
        f"`{shown}` selects no {what}",
        0,
        len(texts[-1]) if texts else 0,
        *([f"{words} {means} no {what} here"] if words and words != f"`{shown}`" else []),
        *_what_exists(candidates, kind),
        code="SEL002",
    )
    error.number = max(len(texts) - 1, 0)
    return error


def _what_exists(candidates: Candidates, kind: Kind) -> Iterator[str]:
    yield from did_you_mean("", candidates.of(kind), f"the {kind} are")
    sets = [*(f"@{one}" for one in candidates.groups_and_labels)]
    sets += [f"island:{one}" for one in candidates.islands]
    yield from did_you_mean("", sets, "groups, labels and islands")


_MOST_NESTED = 16  # groups in groups
_MOST_COMPARED = 10_000_000  # names with globs, which takes seconds


@dataclass(frozen=True)
class Selected:
    """What a selection means, in the order of the spec.

    ``through``: the robots for which a host is selected that no word of the selection means itself.
    """

    names: tuple[str, ...]
    through: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def select(texts: Sequence[str], candidates: Candidates, kind: Kind) -> Selected:
    """Returns what the selections mean together, from left to right.

    Raises ``SelectionError`` for one that is wrong, names something unknown, or if nothing is selected.
    """
    return Selector(candidates, kind).select(texts)


class Selector:
    """Selects hosts or robots of one swarm. What a group or an island means is computed once."""

    def __init__(self, candidates: Candidates, kind: Kind, around: list[str] | None = None) -> None:
        self.candidates, self.kind = candidates, kind
        self._all = frozenset(candidates.of(kind))
        self._sets: dict[str, frozenset[str]] = {}  # what each group and island means
        self._around = [] if around is None else around  # those that are being computed
        self._direct: set[str] = set()  # hosts that a word means itself
        self._robots: set[str] = set()  # robots that a word means
        self.idle: dict[str, None] = {}  # words that mean nothing here
        self._left = _MOST_COMPARED

    @cached_property
    def _of_hosts(self) -> Selector:
        return self if self.kind == "hosts" else Selector(self.candidates, "hosts", self._around)

    def select(self, texts: Sequence[str]) -> Selected:
        """Returns what the selections mean together. Raises ``SelectionError``, also if that is nothing."""
        self.idle = {}
        found = self._union(texts)
        if not found:
            raise selects_nothing(self.candidates, self.kind, texts, self.idle)
        names = tuple(name for name in self.candidates.of(self.kind) if name in found)
        return Selected(names, self._through(names) if self.kind == "hosts" else {})

    def step(self, text: str, before: frozenset[str] | None, number: int = 0) -> frozenset[str]:
        """Returns what one more selection makes of what those before it mean; None before the first.

        Raises ``SelectionError``; ``number`` is the index of the selection in its list.
        """
        try:
            return self._either(parse(text), before)
        except SelectionError as error:
            error.number = error.number if error.inside else number
            raise

    def members(self, group: str) -> frozenset[str]:
        """Returns what a group means; nothing of this kind is no error. Raises ``SelectionError``."""
        return self._set(f"@{group}", self.candidates.groups[group])

    def _through(self, names: Iterable[str]) -> Mapping[str, tuple[str, ...]]:
        driven = self.candidates.robots_of
        through = {host: sorted(driven.get(host, frozenset()) & self._robots) for host in names}
        return {
            host: tuple(robots) for host, robots in through.items() if robots and host not in self._direct
        }

    # Parts of a selection

    def _union(self, texts: Sequence[str]) -> frozenset[str]:
        """What several selections mean: each goes on where the one before ends."""
        found: frozenset[str] | None = None
        for number, text in enumerate(texts):
            found = self.step(text, found, number)
        return found or frozenset()

    def _either(self, either: Either, before: frozenset[str] | None = None) -> frozenset[str]:
        found = before
        for part in either.parts:
            if isinstance(part, Without):
                found = (self._all if found is None else found) - self._means(part.part)
            else:
                found = (found or frozenset()) | self._means(part)
        return found or frozenset()

    def _means(self, part: Part) -> frozenset[str]:
        if isinstance(part, Word):
            return self._word(part)
        if isinstance(part, Without):
            return self._all - self._means(part.part)
        if isinstance(part, Both):
            return frozenset.intersection(*[self._means(one) for one in part.parts])
        return self._either(part)

    def _word(self, word: Word) -> frozenset[str]:
        known = self.candidates.named(word.prefix)
        names: list[str] = []
        for name in word.names:
            if is_glob(name):
                names += self._fitting(word, name, known)
            elif name in known:
                names.append(name)
            else:
                raise unknown_name(self.candidates, word, name)
        found = self._meant(word, names)
        if not found:
            self.idle[word.text] = None
        return found

    def _fitting(self, word: Word, glob: str, known: Collection[str]) -> Iterable[str]:
        self._left -= len(known)
        if self._left < 0:
            raise SelectionError("this compares too many names", word.start, word.end, "use fewer globs")
        fits = re.compile(fnmatch.translate(glob)).match
        return [name for name in known if fits(name)]

    def _meant(self, word: Word, names: Iterable[str]) -> frozenset[str]:
        """What known names mean where hosts, or robots, are selected."""
        given = self.candidates
        found = set[str]()
        hosts: Iterable[str] = ()
        robots: Iterable[str] = ()
        match word.prefix:
            case "" | "host" | "robot":
                hosts = given.hosts.keys() & set(names) if word.prefix != "robot" else ()
                robots = given.robots.keys() & set(names) if word.prefix != "host" else ()
            case "type":
                robots = {robot for name in names for robot in given.types[name]}
            case "program":
                return frozenset(one for name in names if (one := self._of_program(name)) is not None)
            case "@":
                for name in names:
                    if name in given.groups:
                        found |= self._set(f"@{name}", given.groups[name], word)
                labels = [given.labels[name] for name in names if name in given.labels]
                hosts = {one for of_label, _ in labels for one in of_label}
                robots = {one for _, of_label in labels for one in of_label}
            case "island":
                hosts = {one for name in names for one in self._island(name, word)}
            case _:
                hosts = {one for name in names for one in self._of_mode(name, word)}
        return frozenset(found | self._of_kind(hosts, robots))

    def _of_kind(self, hosts: Iterable[str], robots: Iterable[str]) -> set[str]:
        given = self.candidates
        if self.kind == "robots":
            return {*robots, *(one for host in hosts for one in given.robots_of.get(host, ()))}
        self._direct |= {*hosts}
        self._robots |= {*robots}
        places = {given.robots[one].host for one in robots}
        return {*hosts, *(host for host in places if host in given.hosts)}  # type: ignore[arg-type]

    def _of_program(self, name: str) -> str | None:
        program = self.candidates.programs[name]
        if self.kind == "robots":
            return program.robot if program.robot in self.candidates.robots else None
        return self.candidates.host_of_program(name)

    def _of_mode(self, mode: str, word: Word) -> Iterable[str]:
        if not self.candidates.islands:
            return self.candidates.hosts
        islands = [name for name, island in self.candidates.islands.items() if island.mode == mode]
        return [host for name in islands for host in self._island(name, word)]

    def _island(self, name: str, word: Word) -> frozenset[str]:
        """The hosts of an island; names that are no hosts are left out."""
        hosts = self.candidates.islands[name].hosts
        if not any(map(is_selection, hosts)):
            return frozenset(hosts) & self.candidates.hosts.keys()
        return self._of_hosts._set(f"island:{name}", hosts, word)

    def _set(self, name: str, texts: Sequence[str], word: Word | None = None) -> frozenset[str]:
        """What a group or an island means."""
        if name in self._sets:
            return self._sets[name]
        start, end = (word.start, word.end) if word else (0, 0)
        if name in self._around:
            raise _circle([*self._around[self._around.index(name) :], name], start, end)
        if len(self._around) == _MOST_NESTED:
            message = f"more than {_MOST_NESTED} groups are nested here"
            raise SelectionError(message, start, end, "name hosts and robots, or fewer groups in groups")
        idle, self.idle = self.idle, {}
        self._around.append(name)
        try:
            self._sets[name] = self._union(texts)
        except SelectionError as error:
            error.inside = error.inside or name
            raise
        finally:
            self._around.pop()
            self.idle = idle
        return self._sets[name]


def _circle(path: Sequence[str], start: int, end: int) -> SelectionError:
    message = f"`{path[0]}` contains itself: {' -> '.join(path)}"
    error = SelectionError(message, start, end, "remove one of these steps", code="SEL003")
    error.steps = frozenset(path)
    return error
