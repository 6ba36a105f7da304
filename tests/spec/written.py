"""Hypothesis strategies: plain data, and YAML that says it in a random layout, with comments in it."""

from __future__ import annotations

import json
import random
from typing import Any

from hypothesis import strategies as st

KEYS = st.one_of(
    st.from_regex(r"[a-z][a-z0-9-]{0,8}", fullmatch=True), st.sampled_from(["no", "a b", "12", "ä"])
)
WORDS = st.one_of(
    st.booleans(),
    st.none(),
    st.integers(-(10**9), 10**9),
    st.floats(allow_nan=False, allow_infinity=False),
    st.text("abyn019:.-_ #'\"\\äé日,[]{}&*!|>%@`~=+/?", max_size=10),
    st.sampled_from(["no", "012", "0x1f", "1e3", "100000000000", "10:00:00:00:00:59", "2026-01-01"]),
    st.sampled_from(["", "=", "<<", "a: b", "\n", "\t", "\u2003"]),
)
DATA = st.recursive(
    WORDS,
    lambda below: st.one_of(st.lists(below, max_size=4).map(tuple), st.dictionaries(KEYS, below, max_size=4)),
    max_leaves=14,
)
SPECS = st.dictionaries(KEYS, DATA, min_size=1, max_size=4)


class Writer:
    """Writes data as YAML, choosing block or flow style, indents, quotes and comments by chance."""

    def __init__(self, chance: random.Random) -> None:
        self.chance = chance
        self.notes = 0

    def document(self, data: dict[str, Any]) -> str:
        flow = self.chance.random() < 0.1
        lines = [self.flow(data, 0)] if flow else self.block(data, 0)
        text = "\n".join([*self.remarks(""), *lines, *self.remarks("")])
        text += self.chance.choice(["\n", "\n", "\n\n", ""])
        return text.replace("\n", self.chance.choice(["\n", "\n", "\r\n"]))

    def block(self, data: Any, indent: int) -> list[str]:
        """The entries of a collection that is not empty, one or more lines each."""
        pad, lines = " " * indent, []
        for entry in data.items() if isinstance(data, dict) else ((None, one) for one in data):
            lines += self.remarks(pad)
            lines += self.entry(*entry, indent)
        return lines

    def entry(self, key: str | None, value: Any, indent: int) -> list[str]:
        pad = " " * indent
        head = f"{pad}-" if key is None else f"{pad}{self.word(key)}:"
        if isinstance(value, (dict, tuple)) and value and self.chance.random() < 0.6:
            if key is None and self.chance.random() < 0.6:
                inner = indent + self.chance.choice([2, 4])
                first, *rest = self.entries(value, inner)
                return [head + " " * (inner - indent - 1) + first[inner:], *rest]
            least = 0 if isinstance(value, tuple) and key is not None else 1
            return [head + self.note(), *self.block(value, indent + self.chance.randint(least, 4))]
        if value is None and self.chance.random() < 0.5:
            return [head + self.note()]
        if isinstance(value, str) and key is not None and value.isalnum() and self.chance.random() < 0.2:
            return [head + self.chance.choice([" |-", " >-", " |- # note"]), f"{pad}  {value}"]
        return [f"{head}{' ' * self.chance.randint(1, 3)}{self.flow(value, indent + 1)}{self.note()}"]

    def entries(self, value: Any, indent: int) -> list[str]:
        """A block whose first line is not a comment, as it stands behind a dash."""
        lines = self.block(value, indent)
        while lines[0].lstrip().startswith("#") or not lines[0].strip():
            lines = lines[1:]
        return lines

    def flow(self, value: Any, indent: int) -> str:
        if not isinstance(value, (dict, tuple)):
            return self.word(value)
        opening, closing = "{}" if isinstance(value, dict) else "[]"
        if isinstance(value, dict):
            items = [f"{self.word(key)}: {self.flow(one, indent + 2)}" for key, one in value.items()]
        else:
            items = [self.flow(one, indent + 2) for one in value]
        if not items:
            return opening + self.chance.choice(["", " "]) + closing
        comma = self.chance.choice(["", "", ",", " , "])
        if self.chance.random() < 0.3:
            pad = " " * (indent + 2)
            lines = [f"{pad}{item},{self.note()}" for item in items[:-1]]
            lines.append(f"{pad}{items[-1]}{comma.rstrip()}{self.note()}")
            return "\n".join([opening + self.note(), *lines, " " * indent + closing])
        space = self.chance.choice(["", " "])
        return (
            opening + space + self.chance.choice([", ", ",  ", " , "]).join(items) + comma + space + closing
        )

    def word(self, value: Any) -> str:
        if value is None:
            return self.chance.choice(["null", "~"])
        if isinstance(value, float):
            return repr(value)
        if not isinstance(value, str):
            return json.dumps(value)
        plain = value.isascii() and value.isalpha() and value not in ("null", "true", "false")
        if plain and self.chance.random() < 0.7:
            return value
        if value.isprintable() and self.chance.random() < 0.5:
            return "'" + value.replace("'", "''") + "'"
        return json.dumps(value, ensure_ascii=False)

    def note(self) -> str:
        self.notes += 1
        return self.chance.choice(["", "", "", f" # note {self.notes}, [a: {{b", f"   # ä {self.notes}"])

    def remarks(self, pad: str) -> list[str]:
        self.notes += 1
        return self.chance.choice([[], [], [], [""], [f"{pad}# remark {self.notes}: - x"]])
