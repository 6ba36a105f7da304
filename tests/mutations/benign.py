"""Edits after which a spec is as right as before: the checker must not find anything new."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

from tests.mutations.defects import Change, Changes, written
from tests.mutations.edits import changed_lines, edited, listed
from tests.mutations.places import File, Place

BENIGN: dict[str, Changes] = listed(Path(__file__).with_suffix(".yaml"))


def _text(change: Callable[[str], str]) -> Changes:
    def changes(file: File) -> Iterator[Change]:
        text = change(file.text)
        yield Change(text, changed_lines(file.text, text), "the text")

    return changes


BENIGN |= {
    "comment: at the end": _text(lambda text: text + "# the end\n"),
    "comment: on every line": _text(lambda text: re.sub(r"(?m)([^|>\n])$", r"\1   # a note: [x] {y}", text)),
    "comment: none at all": _text(lambda text: re.sub(r"(?m)^\s*#(?! yaml|.*swarmctl:).*\n", "", text)),
    "layout: blank lines": _text(lambda text: re.sub(r"(?m)(?<!here)\n(?=  \w)", "\n\n", text)),
    "layout: a document's beginning": _text(lambda text: "---\n" + text),
    "layout: a document's end": _text(lambda text: text.rstrip() + "\n...\n"),
    "layout: no last line end": _text(str.rstrip),
    "layout: line ends of Windows": _text(lambda text: text.replace("\n", "\r\n")),
    "layout: a mark of the byte order": _text(lambda text: "\ufeff" + text),
    "layout: more space": _text(lambda text: re.sub(r", (?!.*send)", ",   ", text).replace(": {", ":   {")),
    "layout: blanks at line ends": _text(lambda text: re.sub(r"(?m)$", "  ", text).rstrip(" ")),
}


def _with_criteria(namespaced: Changes) -> Changes:
    """The same, also where a criterion of an experiment names a topic of the robot."""

    def changes(file: File) -> Iterator[Change]:
        for one in namespaced(file):
            text = one.text.replace("{topic: k3/", "{topic: lab/one/")
            yield Change(text, changed_lines(file.text, text), one.what)

    return changes


BENIGN["a robot's namespace"] = _with_criteria(BENIGN["a robot's namespace"])


def _values(change: Callable[[str], str], *places: str) -> Changes:
    def changes(file: File) -> Iterator[Change]:
        for place in file.scalars(*places):
            if (
                place.plain
                and place.value not in (None, "true", "false")
                and re.fullmatch(r"[a-z][\w/-]*", str(place.value))
            ):
                yield written(file, place, change(str(place.value)))

    return changes


_TEXTS = ("mode", "name", "leader", "hub", "robots.*.*", "hosts.*.user", "links.*.host", "links.*.robot")
BENIGN["quotes: double"] = _values(lambda old: f'"{old}"', *_TEXTS, "programs.*.*", "control.*.by")
BENIGN["quotes: single"] = _values(lambda old: f"'{old}'", *_TEXTS, "programs.*.*", "control.*.by")
BENIGN["a tag of text"] = _values(lambda old: f"!!str {old}", *_TEXTS)


def _reordered(file: File) -> Iterator[Change]:
    """The entries of a section in the other order."""
    for section in file.values("hosts", "robots", "programs", "links", "control"):
        entries = list(file.names(f"{section.loc[0]}.*")) or file.values(f"{section.loc[0]}.*")
        starts = sorted({file.text.rfind("\n", 0, one.start) + 1 for one in entries})
        if len(starts) > 1 and file.text[section.start] not in "{[":
            ends = [*starts[1:], section.end + 1]
            parts = [file.text[start:end] for start, end in zip(starts, ends, strict=True)]
            if all(part.endswith("\n") for part in parts):
                text = file.text[: starts[0]] + "".join(reversed(parts)) + file.text[ends[-1] :]
                yield Change(text, changed_lines(file.text, text), str(section.loc[0]))


def _block(file: File) -> Iterator[Change]:
    """A mapping between braces, on lines of its own."""
    for place in file.values("hosts.*", "robots.*", "programs.*"):
        keys = [one for one in file.names() if one.loc[:-1] == place.loc]
        if file.text[place.start] == "{" and keys:
            text = "".join(f"\n    {file.text[key.start : _end(file, key)]}" for key in keys)
            yield written(file, place, text)


def _end(file: File, key: Place) -> int:
    return next(one.end for one in file.values() if one.loc == key.loc)


def _renamed(file: File) -> Iterator[Change]:
    """A program that is called otherwise wherever its name stands; specs in several files are left out."""
    for key in file.names("programs.*"):
        name = str(key.loc[-1])
        if "include:" not in file.text and len(re.findall(rf"\b{name}\b", file.text)) < 4:
            text = re.sub(rf"(?m)(?<=^  ){name}(?=:)|(?<=by: ){name}\b", f"my-{name}", file.text)
            yield Change(text, changed_lines(file.text, text), name)


def _absent(file: File) -> Iterator[Change]:
    """`~` for a key that is not there."""
    for place in file.values("hosts.*", "robots.*", "programs.*"):
        if file.text[place.start] == "{":
            key = {"hosts": "via", "robots": "urdf", "programs": "memory_mb"}[str(place.loc[0])]
            if not any(one.loc == (*place.loc, key) for one in file.names()):
                yield written(file, place, f"{{{key}: ~, {file.text[place.start + 1 : place.end]}")


def _flow(file: File) -> Iterator[Change]:
    """The items of a list between brackets, on lines of their own."""
    for place in file.values("links.*.hosts", "control.*.of"):
        if file.text[place.start] == "[":
            text = file.text[place.start + 1 : place.end - 1].replace(", ", ",\n      ")
            yield written(file, place, f"[\n      {text},\n    ]")


def _addresses(file: File) -> Iterator[Change]:
    """Every host at another address of the same network."""
    text = re.sub(
        r"(address: 192\.168\.77\.)(\d+)(?=[,}])", lambda old: f"{old[1]}{int(old[2]) + 60}", file.text
    )
    yield Change(text, changed_lines(file.text, text), "hosts")


def _selected(file: File) -> Iterator[Change]:
    """A list of every host as a selection."""
    for place in file.values("links.0.hosts"):
        named = {one.value for one in file.scalars("links.0.hosts.*")}
        if named == {one.loc[1] for one in file.names("hosts.*")}:
            yield written(file, place, '["host:*"]')


def _spare(file: File) -> Iterator[Change]:
    """A host more on the network, where no island has to have it."""
    if not any(file.names("islands")):
        spare = ("hosts/+spare", "{address: 192.168.77.250, optional: true}")
        yield from edited(file, spare, ("links/0/hosts/*", "spare"))


BENIGN |= {
    "a spare host": _spare,
    "order: of entries": _reordered,
    "style: blocks": _block,
    "style: a list on several lines": _flow,
    "a program renamed": _renamed,
    "nothing for an absent key": _absent,
    "other addresses": _addresses,
    "a selection for a list": _selected,
}
