"""Migrates the text of a spec to another version of the format: comments, layout, includes and ranges stay.

Each file laid over a spec is migrated by itself, since what it hides below it has to change as well.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import yaml

from swarmctl.diagnostics import Diagnostic, Edit, Span, has_errors
from swarmctl.migration.steps import Change, Step
from swarmctl.migration.versions import KEY, SPEC_VERSIONS, Versions, declared
from swarmctl.yamltext import edits, ranges
from swarmctl.yamltext.comments import lost_comments
from swarmctl.yamltext.files import Read
from swarmctl.yamltext.include import tree_of
from swarmctl.yamltext.limits import LoadBudget
from swarmctl.yamltext.project_files import ProjectFiles
from swarmctl.yamltext.source import Source, source_of


class UnreadableError(Exception):
    """A file of the spec cannot be read; ``found`` has the reasons."""

    def __init__(self, found: Sequence[Diagnostic]) -> None:
        super().__init__("the spec cannot be read")
        self.found = tuple(found)


@dataclass(frozen=True)
class Migrated:
    """The new texts of the files that changed, what was done, and what a person has to do.

    With ``undone`` changes the texts are those of the last version that was reached, and not to be written.
    """

    version: int | None  # that the spec declared; None: none that is known
    texts: Mapping[str, str]
    notes: tuple[str, ...] = ()
    undone: tuple[tuple[Span, str], ...] = ()


def migrated(layers: Sequence[Path], read: Read, to: int, versions: Versions = SPEC_VERSIONS) -> Migrated:
    """Returns a spec and the files laid over it in version ``to``. Raises UnreadableError."""
    texts: dict[str, str] = {}
    version = _version(layers, read)
    if version is None or (version < to and version not in versions.steps_from):
        return Migrated(None, {})
    notes: list[str] = []
    for step_from in range(version, to):
        undone: list[tuple[Span, str]] = []
        new = dict(texts)
        for step in (*versions.steps_from[step_from], _declares(step_from + 1)):
            for layer in layers:
                undone += _stepped(step, layer, read, new, notes)
        if undone:
            return Migrated(version, texts, tuple(notes), tuple(undone))
        texts = new
    return Migrated(version, texts, (*notes, *_lost_comments(texts, read)))


def _version(layers: Sequence[Path], read: Read) -> int | None:
    """Returns the version that the last layer with one declares."""
    found = [declared(_source(layer, read, {}).root) for layer in layers]
    return next((one for one in reversed(found) if one is not None), None)


def _declares(version: int) -> Step:
    def step(source: Source) -> Iterator[Change]:
        if declared(source.root) is not None:  # a file laid over a spec has no version
            title = f"`{KEY}` is now {version}"
            yield Change((KEY,), title, edits.replace_value(source, (KEY,), version))

    return step


def _stepped(
    step: Step, layer: Path, read: Read, texts: dict[str, str], notes: list[str]
) -> Iterator[tuple[Span, str]]:
    """Makes the changes of one step in ``texts``; yields those that the text does not allow."""
    source = _source(layer, read, texts)
    changes = list(step(source))
    made = edits.joined(change.edits for change in changes)
    whole = {_alone(edit) for edit in made if edit.copies == 1}
    possible: dict[Edit, None] = {}
    done: dict[Span, str] = {}
    for change in changes:
        own = [_alone(edit) for edit in change.edits]
        span = source.span(change.loc, key=True)
        if own and whole.issuperset(own):
            possible |= dict.fromkeys(own)
            done.setdefault(span, f"{span}: {change.title}")  # of the elements of a range, the first
        else:
            why = change.reason or "an alias, or a range whose elements do not change alike, writes it"
            yield span, f"{change.title}: {why}"
    notes += done.values()
    for file in {edit.span.file for edit in possible}:
        texts[file] = edits.apply(source.texts[file], (one for one in possible if one.span.file == file))


def _alone(edit: Edit) -> Edit:
    return replace(edit, copies=1)


def _source(layer: Path, read: Read, texts: Mapping[str, str]) -> Source:
    """Returns the data of one layer with its includes and ranges, of the texts that changed and of files."""

    def current(path: Path) -> bytes:
        return texts[str(path)].encode() if str(path) in texts else read(path)

    files = ProjectFiles.beside(layer, LoadBudget(), current)
    text = files.named(layer)
    root: yaml.Node | None = None
    found: list[Diagnostic] = []
    if isinstance(text, Diagnostic):
        raise UnreadableError([text])
    root, found = tree_of(text, layer, files)
    if root is not None and not has_errors(found):
        root, found = ranges.expand(root)
    source, wrong = source_of(root, str(layer), files.budget.texts)
    if has_errors([*found, *wrong]):
        raise UnreadableError([*found, *wrong])
    return source


def _lost_comments(texts: Mapping[str, str], read: Read) -> Iterator[str]:
    """Yields the comments that stood beside a removed key."""
    for file, text in texts.items():
        for line, comment in lost_comments(read(Path(file)).decode("utf-8-sig"), text):
            yield f"{file}:{line}: the comment of a removed key is gone: {comment}"
