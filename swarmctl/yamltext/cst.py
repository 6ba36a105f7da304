"""Concrete syntax of a YAML text: where every key, value, dash and comma begins and ends, without comments.

The node tree of ``source`` holds the data; this tree holds the offsets that an edit needs.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Literal

import yaml

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_BREAK = re.compile("\r\n|[\n\r\x85\u2028\u2029]")

Kind = Literal["scalar", "alias", "mapping", "sequence"]


@dataclass(frozen=True)
class Part:
    """One value. Offsets count characters; ``slot`` is where a value directly after its colon begins.

    ``begin`` includes its anchor and tag, ``start`` follows them.
    """

    kind: Kind
    begin: int
    start: int
    end: int
    slot: int
    value: str = ""
    style: str = ""
    flow: bool = False
    anchor: str = ""
    entries: tuple[Entry, ...] = ()

    @property
    def empty(self) -> bool:
        """True for an empty value, as in ``key:``, which is null."""
        return self.kind == "scalar" and self.start == self.end


@dataclass(frozen=True)
class Entry:
    """A key with its value, or an item of a list. It begins at its key or its dash."""

    begin: int
    value: Part
    key: Part | None = None
    comma: int | None = None  # the offset after the comma that ends it
    explicit: bool = False  # its key begins with a question mark

    @property
    def end(self) -> int:
        """The offset behind the entry."""
        return max(self.value.end, self.value.slot, self.key.end if self.key else 0)


@dataclass(frozen=True)
class Layout:
    """A text with its parts by start offset."""

    text: str
    lines: tuple[int, ...]  # where each line begins
    parts: dict[tuple[int, Kind], Part] = field(default_factory=dict)
    keys: dict[int, tuple[Part, int]] = field(default_factory=dict)  # a key's mapping and place in it
    items: dict[int, tuple[Part, int]] = field(default_factory=dict)  # an item's list and place in it
    aliased: set[str] = field(default_factory=set)  # anchors with aliases

    def line(self, offset: int) -> int:
        """Returns the line number of an offset, from 0."""
        return bisect_right(self.lines, offset) - 1

    def line_start(self, offset: int) -> int:
        """Returns the offset of the line that contains ``offset``."""
        return self.lines[self.line(offset)]

    def line_end(self, offset: int) -> int:
        """Returns the offset of the next line break, or of the end of the text."""
        found = _BREAK.search(self.text, offset)
        return found.start() if found else len(self.text)

    def next_line(self, offset: int) -> int:
        """Returns the offset of the next line; the end of the text on the last line."""
        found = _BREAK.search(self.text, offset)
        return found.end() if found else len(self.text)

    def line_break(self, offset: int) -> str:
        """Returns the line break of this line, or that of the file if its last line has none."""
        found = _BREAK.search(self.text, offset) or _BREAK.search(self.text)
        return found.group() if found else "\n"


def line_starts(text: str) -> tuple[int, ...]:
    """Returns the offset at which each line begins."""
    return (0, *(found.end() for found in _BREAK.finditer(text)))


@lru_cache(maxsize=8)
def layout(text: str) -> Layout:
    """Returns the layout of a text that is one YAML document."""
    found = Layout(text, line_starts(text))
    _Parser(found).parse()
    return found


class _Parser:
    """Recursive descent over the tokens; ``compose`` has limited their depth."""

    def __init__(self, into: Layout) -> None:
        self.into = into
        self.tokens = [
            token
            for token in yaml.scan(into.text, Loader=_LOADER)
            if not isinstance(token, (yaml.StreamStartToken, yaml.DirectiveToken, yaml.DocumentStartToken))
        ]
        self.at = 0

    def parse(self) -> None:
        self._part(0)

    def _is(self, *kinds: type[yaml.Token]) -> bool:
        return isinstance(self.tokens[self.at], kinds)

    def _take(self) -> yaml.Token:
        self.at += 1
        return self.tokens[self.at - 1]

    def _part(self, slot: int, *, of_list: bool = False) -> Part:
        """Parses the value that begins here, with its anchor and tag."""
        begin, anchor = None, ""
        while self._is(yaml.AnchorToken, yaml.TagToken):
            token = self._take()
            begin = token.start_mark.index if begin is None else begin
            anchor = token.value if isinstance(token, yaml.AnchorToken) else anchor
            slot = token.end_mark.index
        token = self.tokens[self.at]
        start = token.start_mark.index
        begin = start if begin is None else begin
        if self._is(yaml.ScalarToken, yaml.AliasToken):
            part = self._word(begin, slot, anchor)
        elif self._is(yaml.BlockMappingStartToken, yaml.FlowMappingStartToken):
            part = self._collection("mapping", begin, slot, anchor)
        elif self._is(yaml.BlockSequenceStartToken, yaml.FlowSequenceStartToken):
            part = self._collection("sequence", begin, slot, anchor)
        elif (
            self._is(yaml.BlockEntryToken) and not of_list
        ):  # a list whose dashes are not indented below its key
            entries = self._items(())
            part = Part("sequence", begin, start, entries[-1].end, slot, anchor=anchor, entries=entries)
        else:
            part = self._nothing(begin, slot, anchor)
        return self._kept(part)

    def _kept(self, part: Part) -> Part:
        self.into.parts[part.begin, part.kind] = part
        for place, entry in enumerate(part.entries):
            if entry.key is not None:
                self.into.keys[entry.key.begin] = part, place
            else:
                self.into.items[entry.value.begin] = part, place
        return part

    def _word(self, begin: int, slot: int, anchor: str) -> Part:
        token: Any = self._take()
        start, end = token.start_mark.index, token.end_mark.index
        if isinstance(token, yaml.AliasToken):
            self.into.aliased.add(token.value)
            return Part("alias", begin, start, end, slot)
        if token.style in ("|", ">"):
            end = _block_end(self.into.text, start, end)
        return Part(
            "scalar", begin, start, end, slot, value=token.value, style=token.style or "", anchor=anchor
        )

    def _nothing(self, begin: int, slot: int, anchor: str) -> Part:
        """Returns an empty value. In flow style its node begins at the next comma or bracket."""
        in_flow = self._is(yaml.FlowEntryToken, yaml.FlowMappingEndToken, yaml.FlowSequenceEndToken)
        return Part("scalar", begin if in_flow or anchor else slot, slot, slot, slot, anchor=anchor)

    def _collection(self, kind: Kind, begin: int, slot: int, anchor: str) -> Part:
        opened = self._take()
        flow = isinstance(opened, (yaml.FlowMappingStartToken, yaml.FlowSequenceStartToken))
        ends = (yaml.BlockEndToken, yaml.FlowMappingEndToken, yaml.FlowSequenceEndToken)
        if flow:
            entries = self._flow_entries(kind, ends)
        else:
            entries = self._pairs(ends) if kind == "mapping" else self._items(ends)
        closed = self._take()
        start = opened.start_mark.index
        end = closed.end_mark.index if flow else max((one.end for one in entries), default=start)
        return Part(kind, begin, start, end, slot, flow=flow, anchor=anchor, entries=entries)

    def _items(self, ends: tuple[type[yaml.Token], ...]) -> tuple[Entry, ...]:
        """Parses the items of a block list; without ``ends`` it ends where no dash follows."""
        entries = []
        while not self._is(*ends) if ends else self._is(yaml.BlockEntryToken):
            dash = self._take()
            entries.append(Entry(dash.start_mark.index, self._part(dash.end_mark.index, of_list=True)))
        return tuple(entries)

    def _pairs(self, ends: tuple[type[yaml.Token], ...]) -> tuple[Entry, ...]:
        entries = []
        while not self._is(*ends):
            entries.append(self._pair())
        return tuple(entries)

    def _pair(self) -> Entry:
        """Parses ``key: value``; key, value and colon may be missing."""
        explicit, begin = False, self.tokens[self.at].start_mark.index
        if self._is(yaml.KeyToken):
            token = self._take()
            explicit = token.end_mark.index > token.start_mark.index
        key = self._nothing(begin, begin, "") if self._is(yaml.ValueToken) else self._part(begin)
        if self._is(yaml.ValueToken):
            value = self._part(self._take().end_mark.index)
        else:
            value = self._kept(self._nothing(self.tokens[self.at].start_mark.index, key.end, ""))
        return Entry(begin, value, key, explicit=explicit)

    def _flow_entries(self, kind: Kind, ends: tuple[type[yaml.Token], ...]) -> tuple[Entry, ...]:
        entries = []
        while not self._is(*ends):
            begin = self.tokens[self.at].start_mark.index
            if kind == "mapping":
                entry = self._pair()
            elif self._is(yaml.KeyToken):  # [a: 1], a mapping without brackets
                pair = self._pair()
                entry = Entry(
                    begin,
                    self._kept(Part("mapping", begin, begin, pair.end, begin, flow=True, entries=(pair,))),
                )
            else:
                entry = Entry(begin, self._part(begin))
            comma = self._take().end_mark.index if self._is(yaml.FlowEntryToken) else None
            entries.append(Entry(entry.begin, entry.value, entry.key, comma, entry.explicit))
        return tuple(entries)


def _block_end(text: str, start: int, end: int) -> int:
    """Returns the end of a block scalar without its line break; ``|+`` keeps trailing empty lines."""
    written = text[start:end]
    if "+" in written[: written.find("\n")].split("#")[0]:
        return start + len(written.removesuffix("\n").removesuffix("\r"))
    return start + len(written.rstrip())


def lost_comments(before: str, after: str) -> Iterator[tuple[int, str]]:
    """Yields the comments of ``before`` that ``after`` lacks, with their lines."""
    left = Counter(comment for _, comment in _comments(after))
    for line, comment in _comments(before):
        left[comment] -= 1
        if left[comment] < 0:
            yield line, comment


def _comments(text: str) -> Iterator[tuple[int, str]]:
    for number, line in enumerate(text.splitlines(), start=1):
        before, sign, rest = line.partition("#")
        if sign and (not before or before[-1].isspace()):
            yield number, f"# {rest.strip()}"
