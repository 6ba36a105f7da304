"""A draft of a spec as values, each with its place in the files of the lab or a guess, and as YAML."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from swarmctl.ros_packages.launch_files import Place
from swarmctl.swarm.names import LONGEST_NAME, valid_name
from swarmctl.yamltext.scalars import literal, text_of

GUESS = "guess: "
FILL_IN = "fill in: "


@dataclass(frozen=True)
class Value:
    """A value that stands at ``place`` of a file or, with a reason in ``guess``, is derived from others.

    ``was`` is what the file has, where it had to be converted, and ``needed`` what ROS needs there. If no
    file has the value, ``fill_in`` says what to write, and ``value`` is an example.
    """

    value: Any
    place: Place | None = None
    guess: str = ""
    was: str = ""
    fill_in: str = ""
    needed: str = ""
    instead: str = ""  # what a spec has, where the two are compared
    by: str = ""  # what starts it, where that is another file
    places: Mapping[str, Place] = field(default_factory=dict)  # of keys of a mapping

    @property
    def source(self) -> str:
        """Where it is from, as a comment says it; empty for an example."""
        if self.fill_in:
            return ""
        was = f"{literal(self.was, chr(34))} there" if self.was else ""
        needed = f"ROS needs {self.needed}" if self.needed else ""
        instead = f"the spec has {self.instead}" if self.instead else ""
        by = f"started by {self.by}" if self.by else ""
        others = (f"{key}: {one}" for key, one in self.places.items() if one != self.place)
        was = ", ".join(one for one in (was, needed, instead, by, *others) if one)
        if not self.guess:
            return ", ".join(one for one in (f"from {self.place}" if self.place else "", was) if one)
        there = ", ".join(one for one in (str(self.place or ""), was) if one)
        return f"{GUESS}{self.guess}{f' ({there})' if there else ''}; check"

    @property
    def todo(self) -> str:
        """What is to fill in, as a comment says it; empty if it is known."""
        return f"{FILL_IN}{self.fill_in}" if self.fill_in else ""


@dataclass
class Entry:
    """A host, a robot or a program."""

    name: Value
    fields: dict[str, Value] = field(default_factory=dict)


@dataclass
class Draft:
    """A spec to be. A reader of files adds what it finds."""

    source: str
    name: Value = Value("lab", guess="no file names the whole")
    first: dict[str, Value] = field(default_factory=dict)  # above the hosts
    hosts: dict[str, Entry] = field(default_factory=dict)
    robots: dict[str, Entry] = field(default_factory=dict)
    networks: list[Value] = field(default_factory=list)
    lines: list[Value] = field(default_factory=list)  # between robots and their hosts
    programs: dict[str, Entry] = field(default_factory=dict)
    multimaster: dict[str, Value] = field(default_factory=dict)
    patterns: dict[str, Value] = field(default_factory=dict)  # keys of `multimaster`, to fill in
    last: dict[str, Value] = field(default_factory=dict)  # below the programs
    masters: dict[str, Value] = field(default_factory=dict)  # the host of each host's master
    unread: list[str] = field(default_factory=list)  # places that are not in the draft, and why
    files: set[str] = field(default_factory=set)  # that were read, with those that others include


def named(text: str, prefix: str, place: Place | None, taken: Collection[str], guess: str = "") -> Value:
    """Returns a name of the spec for what a file calls ``text``; one that is ``taken`` gets a number."""
    name = valid_name(text, prefix)
    found, count = name, 1
    while found in taken:
        count += 1
        found = f"{name[: LONGEST_NAME - len(str(count)) - 1]}-{count}"
    return Value(found, place, guess, was=text if found != text else "")


_BELOW = "its `fill in` is below"  # where a value is missing, validate reports the name above it
_LONGEST = 100  # characters of an entry on one line
_NO_ROBOT = f"{FILL_IN}no robot was found; write each, and its link"


@dataclass(frozen=True)
class Line:
    """A line of a draft. Its comment says where it is from, or why it is a guess, and what to fill in."""

    text: str
    source: str = ""
    todo: str = ""

    def __str__(self) -> str:
        comment = "; ".join(one for one in (self.source, self.todo) if one)
        return f"{self.text}  # {_one_line(comment)}" if comment else self.text


def lines_of(draft: Draft) -> list[Line]:
    """Returns the lines of a draft as YAML. No value and no comment can change its structure."""
    unlinked = {one.value["robot"] for one in draft.lines if one.fill_in}
    return [
        Line(f"# Drafted by swarmctl import from {_one_line(draft.source)}."),
        Line("# A value without a comment is from the same line as the name above it."),
        Line("# Check each `guess`, and complete each `fill in`."),
        *(Line(one) for one in ("#", "# Not read:") if draft.unread),
        *(Line(f"#   {_one_line(one)}") for one in dict.fromkeys(draft.unread)),
        Line("version: 1"),
        _field("", "name", draft.name),
        *_marked([_field("", key, one) for key, one in draft.first.items()]),
        *_section("hosts", draft.hosts),
        *(_section("robots", draft.robots, unlinked) if draft.robots else _no_robot(draft)),
        *_links([*draft.networks, *draft.lines]),
        *(_section("programs", draft.programs) if draft.programs else ()),
        *([Line("")] if draft.last else ()),
        *(_field("", key, one) for key, one in draft.last.items()),
        *_multimaster(draft),
    ]


def lines_beyond(draft: Draft, spec: str) -> list[Line]:
    """Returns the lines of what a draft has and a spec has not; none if the spec has all of it."""
    unlinked = {one.value["robot"] for one in draft.lines if one.fill_in}
    found = [
        *(_field("", key, one) for key, one in draft.first.items()),
        *(_section("hosts", draft.hosts) if draft.hosts else ()),
        *(_section("robots", draft.robots, unlinked) if draft.robots else ()),
        *_links([*draft.networks, *draft.lines]),
        *(_section("programs", draft.programs) if draft.programs else ()),
        *_multimaster(draft),
    ]
    head = Line(f"# What {_one_line(draft.source)} has and {_one_line(spec)} has not.")
    return [head, *found] if found else []


def text_of_lines(lines: Sequence[Line]) -> str:
    """Returns the text of a file."""
    return "".join(f"{line}\n" for line in lines)


def with_errors(lines: Sequence[Line], errors: Mapping[int, str]) -> list[Line]:
    """Returns the lines; where an error has the number of one, this is to fill in."""
    return [
        replace(line, todo=f"{FILL_IN}{errors[number]}") if number in errors and not line.todo else line
        for number, line in enumerate(lines, 1)
    ]


def summary(draft: Draft, lines: Sequence[Line]) -> str:
    """Returns what a draft has, and how much of it is to check and to fill in."""
    has = (
        _number(len(draft.hosts), "host"),
        _number(len(draft.robots), "robot"),
        _number(sum(not one.name.fill_in for one in draft.programs.values()), "program"),
    )
    guesses = sum(line.source.startswith(GUESS) for line in lines)
    blanks = sum(line.todo.startswith(FILL_IN) for line in lines)
    kept, unread = sum(map(_leaves, _values(draft))), len(dict.fromkeys(draft.unread))
    values = (
        f"{_number(kept + blanks + unread, 'value')}: {kept} kept, {blanks} to fill in, {unread} not read"
    )
    return f"{', '.join(has)}; {values}; {_number(guesses, 'guess', 'guesses')} to check"


def _values(draft: Draft) -> Iterator[Value]:
    """The values of a draft that files of the lab have."""
    entries = [*draft.hosts.values(), *draft.robots.values(), *draft.programs.values()]
    fields = (one for entry in entries for one in (entry.name, *entry.fields.values()))
    others = (draft.first, draft.multimaster, draft.patterns, draft.last)
    keys = (one for group in others for one in group.values())
    for one in (*fields, *keys, *draft.networks, *draft.lines):
        if one.place is not None and not one.fill_in:
            yield one


def _leaves(value: Value | Any) -> int:
    """How many single values a value has."""
    found = value.value if isinstance(value, Value) else value
    if isinstance(found, dict):
        return sum(map(_leaves, found.values()))
    return sum(map(_leaves, found)) if isinstance(found, (list, tuple)) else 1


def _number(count: int, word: str, several: str = "") -> str:
    return f"{count} {word if count == 1 else several or word + 's'}"


def _one_line(text: str) -> str:
    """Text that may stand in a comment: what is not printable, such as a line end, is escaped."""
    return "".join(
        char if char.isprintable() else char.encode("unicode_escape", "surrogatepass").decode()
        for char in text
    )


def _marked(lines: Sequence[Line], *, is_unlinked: bool = False) -> list[Line]:
    """The lines of an entry; the first one says that there is something to fill in below it."""
    first, *rest = lines
    is_blank = is_unlinked or any(line.todo for line in rest)
    return [replace(first, todo=_BELOW) if is_blank else first, *rest]


def _multimaster(draft: Draft) -> Sequence[Line]:
    if not draft.multimaster:
        return ()
    fields = (*draft.multimaster.items(), *draft.patterns.items())
    return [Line(""), *_marked([Line("multimaster:"), *(_field("  ", key, one) for key, one in fields)])]


def _no_robot(draft: Draft) -> Iterator[Line]:
    yield Line("")
    yield Line("robots:", todo=_NO_ROBOT)
    yield Line(f"  # k3: {literal({'type': 'khepera3', 'host': next(iter(draft.hosts))})}")


def _section(key: str, entries: Mapping[str, Entry], unlinked: set[str] | None = None) -> Iterator[Line]:
    yield Line("")
    yield Line(f"{'# ' if all(one.name.fill_in for one in entries.values()) else ''}{key}:")
    for name, entry in entries.items():
        yield from _entry(name, entry, is_unlinked=name in (unlinked or ()))


def _entry(name: str, entry: Entry, *, is_unlinked: bool) -> Sequence[Line]:
    if entry.name.fill_in:
        shown = {key: one.value for key, one in entry.fields.items() if not one.fill_in}
        whys = (f"; {key}: {one.fill_in}" for key, one in entry.fields.items() if one.fill_in)
        return [Line(f"  # {text_of(name)}: {literal(shown)}", todo=f"{entry.name.todo}{''.join(whys)}")]
    known = {key: one.value for key, one in entry.fields.items() if not one.fill_in}
    fields = [_field("    ", key, one, entry.name.place) for key, one in entry.fields.items()]
    whole = Line(f"  {text_of(name)}: {literal(known)}", entry.name.source)
    if len(whole.text) <= _LONGEST and not any(line.source or line.todo for line in fields):
        return _marked([whole], is_unlinked=is_unlinked)
    head = Line(f"  {text_of(name)}:{'' if known else ' {}'}", entry.name.source)
    return _marked([head, *fields], is_unlinked=is_unlinked)


def _field(indent: str, key: str, one: Value, shown: Place | None = None) -> Line:
    """A value; its source is left out if it is the place ``shown`` by the comment above it."""
    is_shown = shown is not None and one.place == shown and not (one.guess or one.was or one.instead)
    mark = "# " if one.fill_in else ""
    return Line(f"{indent}{mark}{key}: {literal(one.value)}", "" if is_shown else one.source, one.todo)


def _links(links: Sequence[Value]) -> Iterator[Line]:
    if links:
        yield Line("")
        yield Line("# links:" if all(one.fill_in for one in links) else "links:")
    for one in links:
        yield Line(f"  {'# ' if one.fill_in else ''}- {literal(one.value)}", one.source, one.todo)
