"""Writes a draft as YAML: a comment at each value names its source, its guess or what to fill in."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from swarmctl.importing.draft import Blank, Draft, Entry, Fact, Field
from swarmctl.yamltext.emit import literal, text_of

GUESS = "guess: "
FILL_IN = "fill in: "
BELOW = "its `fill in` is below"  # where a value is missing, validate reports the name above it
_LONGEST = 100  # characters of an entry on one line
_ADDRESS = {"address": "192.168.77.11"}
_NO_ROBOT = Blank(
    {"k3": {"type": "khepera3", "host": "k3-pi"}}, "no robot was found; write each, and its link"
)


@dataclass(frozen=True)
class Line:
    """A line of a draft. ``is_marked`` if its comment says that something is to fill in."""

    text: str
    comment: str = ""
    is_marked: bool = False

    def __str__(self) -> str:
        return f"{self.text}  # {one_line(self.comment)}" if self.comment else self.text


def lines_of(draft: Draft) -> list[Line]:
    """Returns the lines of a draft as YAML. No value and no comment can change its structure."""
    unlinked = {
        str(one.example["robot"]) for one in draft.links if isinstance(one, Blank) and "robot" in one.example
    }
    return [
        Line(f"# Drafted by swarmctl import from {one_line(draft.source)}."),
        Line("# A value without a comment is from the same line as the name above it."),
        Line("# Check each `guess`, and complete each `fill in`."),
        *_head(draft),
        Line("version: 1"),
        _field("", "name", draft.name),
        *_first(draft.first),
        *_section("hosts", draft.hosts, set(), _no_host(draft)),
        *_section("robots", draft.robots, unlinked, _NO_ROBOT),
        *_links(draft.links),
        *(_section("programs", draft.programs, set(), None) if draft.programs else ()),
        *([Line("")] if draft.last else []),
        *(_field("", key, value) for key, value in draft.last.items()),
    ]


def text_of_lines(lines: Sequence[Line]) -> str:
    """Returns the text of a file."""
    return "".join(f"{line}\n" for line in lines)


def with_errors(lines: Sequence[Line], errors: Mapping[int, str]) -> tuple[list[Line], int]:
    """Returns the lines with what is wrong, by number, as places to fill in, and how many these are.

    A line that is marked already stays as it is.
    """
    marked, added = list(lines), 0
    for number, message in errors.items():
        line = lines[number - 1]
        if not line.is_marked:
            comment = "; ".join(one for one in (line.comment, f"{FILL_IN}{message}") if one)
            marked[number - 1] = replace(line, comment=comment, is_marked=True)
            added += 1
    return marked, added


def one_line(text: str) -> str:
    """Returns text that may stand in a comment: what is not printable, such as a line end, is escaped."""
    return "".join(
        char if char.isprintable() else char.encode("unicode_escape", "surrogatepass").decode()
        for char in text
    )


def _no_host(draft: Draft) -> Blank:
    """An example of a host, with a Bluetooth adapter if a robot has a Bluetooth line."""
    lines = [one.value for one in draft.links if isinstance(one, Fact)]
    adapter = {"bluetooth": ["hci0"]} if any(one["kind"] == "bluetooth" for one in lines) else {}
    return Blank({"k3-pi": {**_ADDRESS, **adapter}}, "no host was found; write one a computer")


def _head(draft: Draft) -> Iterator[Line]:
    if draft.notes:
        yield Line("#")
    for note in draft.notes:
        yield Line(f"# {one_line(note)}")
    if draft.unread:
        yield Line("#")
        yield Line("# Not read:")
    for one in draft.unread:
        yield Line(f"#   {one_line(f'{one.place}: {one.why}')}")


def _first(fields: Mapping[str, Field]) -> Iterator[Line]:
    """The mode and what belongs to it; validate reports at the mode what is missing there."""
    blank = any(isinstance(one, Blank) for one in fields.values())
    for key, value in fields.items():
        line = _field("", key, value)
        marked = blank and not line.is_marked
        yield replace(line, comment=f"{line.comment}; {BELOW}", is_marked=True) if marked else line


def _section(key: str, entries: Sequence[Entry], unlinked: set[str], none: Blank | None) -> Iterator[Line]:
    yield Line("")
    if not entries and none is not None:
        yield Line(f"{key}:", f"{FILL_IN}{none.why}", is_marked=True)
        ((name, fields),) = none.example.items()
        yield Line(f"  # {name}: {literal(fields)}")
        return
    yield Line(f"{key}:")
    for entry in entries:
        yield from _entry(entry, is_unlinked=entry.key in unlinked)


def _entry(entry: Entry, *, is_unlinked: bool) -> Iterator[Line]:
    blank = is_unlinked or any(isinstance(one, Blank) for one in entry.fields.values())
    comment = "; ".join(one for one in (_comment(entry.name), BELOW if blank else "") if one)
    known = {key: one.value for key, one in entry.fields.items() if isinstance(one, Fact)}
    on_one_line = f"  {text_of(entry.key)}: {literal(known)}"
    notes = [Line(f"    # {one_line(note)}") for note in entry.notes]
    if _is_alike(entry) and len(on_one_line) <= _LONGEST:
        yield Line(on_one_line, comment, blank)
        yield from notes
        return
    yield Line(f"  {text_of(entry.key)}:{'' if known else ' {}'}", comment, blank)
    yield from notes
    for key, value in entry.fields.items():
        line = _field("    ", key, value)
        yield Line(line.text) if _is_of_line(value, entry.name) else line


def _is_of_line(value: Field, name: Fact) -> bool:
    """True for a value whose source the comment at the name of its entry shows already."""
    return isinstance(value, Fact) and value.place == name.place and not value.guess and not value.was


def _is_alike(entry: Entry) -> bool:
    """True if one comment covers the name and all values."""
    return all(_is_of_line(one, entry.name) for one in entry.fields.values())


def _links(links: Sequence[Field]) -> Iterator[Line]:
    if links:
        yield Line("")
        yield Line("links:" if any(isinstance(one, Fact) for one in links) else "# links:")
    for one in links:
        value, mark = (one.value, "") if isinstance(one, Fact) else (one.example, "# ")
        yield Line(f"  {mark}- {literal(value)}", _comment(one), isinstance(one, Blank))


def _field(indent: str, key: str, value: Field) -> Line:
    if isinstance(value, Blank):
        return Line(f"{indent}# {key}: {literal(value.example)}", _comment(value), is_marked=True)
    return Line(f"{indent}{key}: {literal(value.value)}", _comment(value))


def _comment(value: Field) -> str:
    if isinstance(value, Blank):
        return f"{FILL_IN}{value.why}"
    was = f"{literal(value.was, chr(34))} there" if value.was else ""
    if value.guess:
        source = ", ".join(one for one in (str(value.place or ""), was) if one)
        return f"{GUESS}{value.guess}{f' ({source})' if source else ''}; check"
    source = f"from {value.place}" if value.place else ""
    return ", ".join(one for one in (source, was) if one)
