"""Entries that are missing, stand twice or at another place, and YAML that is laid out wrong."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from tests.mutations.defects import MISTAKES, Change, mistake, removed, written
from tests.mutations.places import File, Loc

_REQUIRED = (
    *("version", "name", "mode", "leader", "hub", "robots", "hosts", "links", "islands", "control.*.by"),
    *("hosts.*.address", "robots.*.type", "links.*.kind", "links.*.host", "links.*.robot", "links.*.name"),
    *("links.*.hosts", "links.*.mac", "links.*.usb", "control.*.of", "islands.*.mode", "islands.*.hosts"),
    *("programs.*.package", "programs.*.executable", "programs.*.use"),
    *("programs.*.publishes.*.topic", "programs.*.publishes.*.type"),
    *("title", "link", "kinematics", "protocol", "firmware_dead_man", "link.kinds", "link.baud"),
    *("kinematics.wheel_separation", "kinematics.wheel_speed_max", "kinematics.scales"),
    *("protocol.kind", "protocol.terminator", "protocol.set_speed", "protocol.queries"),
    *("protocol.queries.*", "protocol.queries.*.*", "sensors.*.kind"),
)


@mistake("a key is missing")
def _missing_key(file: File) -> Iterator[Change]:
    for key in file.names(*_REQUIRED):
        around = next(one for one in file.values() if one.loc == key.loc[:-1])
        last = around.line + file.text[around.start : around.end].count("\n")
        yield from removed(file, key, *range(max(1, around.line - 1), last + 1), words=(str(key.loc[-1]),))


@mistake("an entry is missing")
def _missing_entry(file: File) -> Iterator[Change]:
    for place in file.values("hosts.*", "robots.*", "programs.*", "links.*", "islands.*"):
        last = place.loc[-1]
        yield from removed(file, place, words=[last] if isinstance(last, str) else _names_in(file, place.loc))


def _names_in(file: File, loc: Loc) -> list[str]:
    ends = [str(one.value) for one in file.scalars() if one.loc in ((*loc, "robot"), (*loc, "host"))]
    return ends + [str(one.value) for one in file.scalars() if one.loc[:-1] == (*loc, "hosts")]


@mistake("a host is not on the network")
def _off_network(file: File) -> Iterator[Change]:
    for place in file.scalars("links.*.hosts.*"):
        yield from removed(file, place, words=(str(place.value),))


@mistake("a key stands twice")
def _doubled_key(file: File) -> Iterator[Change]:
    for key in file.names(
        "leader", "mode", "name", "hosts.*.address", "robots.*.type", "links.*.host", "links.*.baud"
    ):
        value = next(one for one in file.values() if one.loc == key.loc)
        pair = file.text[key.start : value.end]
        between = ", " if key.flow else "\n" + " " * (key.start - file.text.rfind("\n", 0, key.start) - 1)
        yield Change(
            file.text[: value.end] + between + pair + file.text[value.end :],
            frozenset((key.line, key.line + 1)),
            ".".join(map(str, key.loc)),
        )


@mistake("an entry stands twice")
def _doubled_entry(file: File) -> Iterator[Change]:
    for place in file.values("links.*", "control.*", "hosts.*", "robots.*"):
        line = file.text.splitlines(keepends=True)[place.line - 1]
        if line.rstrip().endswith("}") and line.startswith("  "):
            start = sum(map(len, file.text.splitlines(keepends=True)[: place.line]))
            text = file.text[:start] + line + file.text[start:]
            yield Change(text, frozenset((place.line, place.line + 1)), ".".join(map(str, place.loc)))


@mistake("a name stands twice in a list")
def _doubled_name(file: File) -> Iterator[Change]:
    for place in file.scalars("control.*.of.*", "links.*.hosts.*"):
        if place.flow:
            yield written(file, place, f"{place.value}, {place.value}")


@mistake("a key one level too high")
def _too_high(file: File) -> Iterator[Change]:
    for key in file.names("programs.*.*", "kinematics.*", "protocol.*", "link.*"):
        line = file.text.splitlines(keepends=True)[key.line - 1]
        if not key.flow and line.startswith("  "):
            start = sum(map(len, file.text.splitlines(keepends=True)[: key.line - 1]))
            indent = 4 if line.startswith("    ") else 2
            text = file.text[:start] + line[indent - (indent // 2) :] + file.text[start + len(line) :]
            yield Change(text, frozenset((key.line - 1, key.line, key.line + 1)), ".".join(map(str, key.loc)))


def _lines(slip: Callable[[str], str]) -> Callable[[File], Iterator[Change]]:
    def changes(file: File) -> Iterator[Change]:
        lines = file.text.splitlines(keepends=True)
        for number, line in enumerate(lines):
            if line.strip() and not line.lstrip().startswith("#") and slip(line) != line:
                text = "".join([*lines[:number], slip(line), *lines[number + 1 :]])
                # an error of layout may show on a neighbouring line
                yield Change(text, frozenset((number, number + 1, number + 2)), f"line {number + 1}")

    return changes


MISTAKES["layout: a tab"] = _lines(lambda line: "\t" + line.lstrip() if line.startswith("  ") else line)
MISTAKES["layout: one space too many"] = _lines(lambda line: " " + line)
MISTAKES["layout: no space after the colon"] = _lines(lambda line: line.replace(": ", ":", 1))
MISTAKES["layout: a brace is missing"] = _lines(lambda line: line.replace("}", "", 1))
MISTAKES["layout: a bracket is missing"] = _lines(lambda line: line.replace("]", "", 1))
MISTAKES["layout: a comma is missing"] = _lines(
    lambda line: line.replace(", ", " ", 1) if "{" in line else line
)
MISTAKES["layout: a hyphen is missing"] = _lines(
    lambda line: line.replace("- ", "  ", 1) if line.lstrip().startswith("- ") else line
)
MISTAKES["layout: an equals sign for the colon"] = _lines(lambda line: line.replace(": ", " = ", 1))
MISTAKES["layout: a semicolon for a comma"] = _lines(
    lambda line: line.replace(", ", "; ", 1) if "{" in line else line
)
MISTAKES["layout: a no-break space"] = _lines(lambda line: line.replace(": ", ":\u00a0", 1))
MISTAKES["layout: quotes of a word processor"] = _lines(
    lambda line: line.replace('"', "\u201c", 1).replace('"', "\u201d", 1)
)
