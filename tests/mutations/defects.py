"""What is wrong in a mutated spec, and the registry of everything that people get wrong."""

from __future__ import annotations

import random
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tests import ROOT
from tests.mutations.places import File, Place

FLEET = Path(__file__).parent / "fleet/swarm.yaml"


@dataclass(frozen=True)
class Base:
    """A correct spec: the files that are given to `validate`, and all files whose text is mutated."""

    name: str
    layers: tuple[Path, ...]
    files: tuple[File, ...]


@dataclass(frozen=True)
class Change:
    """One way to get a file wrong: its new text, and the lines where a person would look for the fault."""

    text: str
    lines: frozenset[int]
    what: str  # of the place, such as `robots.k3.host`
    words: tuple[str, ...] = ()  # a finding at a line with one of these is at the right place, too


@dataclass(frozen=True)
class Defect:
    """A base with one change in one file."""

    base: Base
    file: File
    mistake: str
    change: Change

    def __str__(self) -> str:
        return f"{self.base.name}: {self.mistake}: {self.change.what} ({self.file.path.name})"


Changes = Callable[[File], Iterator[Change]]
MISTAKES: dict[str, Changes] = {}


def mistake(name: str) -> Callable[[Changes], Changes]:
    """Registers a function that yields every place of a file where people make this mistake."""

    def registered(changes: Changes) -> Changes:
        assert name not in MISTAKES
        MISTAKES[name] = changes
        return changes

    return registered


def written(file: File, place: Place, text: str, *lines: int, words: Iterable[str] = ()) -> Change:
    """Returns the change that writes ``text`` at ``place``."""
    return Change(file.with_text(place, text), frozenset((place.line, *lines)), _dotted(place), tuple(words))


def removed(file: File, place: Place, *lines: int, words: Iterable[str] = ()) -> Iterator[Change]:
    """Yields the change that removes an entry; nothing if its list would be empty."""
    text = file.without(place.loc)
    if text is not None:
        yield Change(text, frozenset(lines), _dotted(place), tuple(words))


def _dotted(place: Place) -> str:
    return ".".join(map(str, place.loc))


def bases() -> Iterator[Base]:
    """Yields the shipped examples and a fleet of forty hosts in several files."""
    for spec in sorted(ROOT.glob("examples/*/swarm.yaml")):
        yield _base(spec.parent.name, (spec,), (spec,))
        if (over := spec.parent / "fkie.yaml").exists():
            yield _base(f"{spec.parent.name}+fkie", (spec, over), (over,))
    parts = sorted(one for one in FLEET.parent.rglob("*.yaml") if one != FLEET)
    yield _base("fleet", (FLEET,), (FLEET, *parts))


def _base(name: str, layers: tuple[Path, ...], files: Sequence[Path]) -> Base:
    return Base(name, layers, tuple(File(path, path.read_text("utf-8")) for path in files))


def defects(base: Base, most: int, kinds: Mapping[str, Changes] = MISTAKES) -> Iterator[Defect]:
    """Yields the defects of one base: of each mistake in each file ``most`` at most, always the same ones."""
    for file in base.files:
        for name, changes in kinds.items():
            found = [one for one in changes(file) if one.text != file.text]
            chance = random.Random(zlib.crc32(f"{base.name} {file.path.name} {name}".encode()))
            for one in found if len(found) <= most else chance.sample(found, most):
                yield Defect(base, file, name, one)
