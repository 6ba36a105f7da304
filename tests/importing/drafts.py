"""Drafts of labs for tests, and what `swarmctl validate` reports about them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml
from hypothesis import strategies as st

from swarmctl.importing.drafting import Imported, Kind, imported
from swarmctl.rulebook import Severity
from tests.loading import lint_files

LABS = Path(__file__).parent / "labs"


def lab(folder: Path, files: Mapping[str, str]) -> Path:
    """Writes the files of a lab into a folder."""
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, "utf-8")
    return folder


def draft(path: Path, kind: Kind | None = None) -> Imported:
    """The draft of a lab; none of its errors is at a line without `fill in`."""
    found = imported(path, kind, Path("nowhere/swarm.yaml"))
    assert unmarked_errors(found.text) == []
    assert todo(found.text) == tuple(map(int, _COUNTS.search(found.summary).groups()))  # type: ignore[union-attr]
    return found


def data(found: Imported) -> Any:
    """What a YAML reader makes of a draft."""
    return yaml.safe_load(found.text)


def unmarked_errors(text: str) -> list[str]:
    """The errors of a spec at lines that do not say that something is to fill in."""
    spec = Path("nowhere/swarm.yaml")
    errors = [
        one
        for one in lint_files([spec], lambda _: text.encode()).diagnostics
        if one.severity is Severity.ERROR
    ]
    lines = text.split("\n")
    return [
        f"{one.span}: {one.message}"
        for one in errors
        if not one.span or "fill in" not in lines[one.span.line - 1]
    ]


def vanished(source: str, path: str, found: Imported) -> list[str]:
    """The lines of a YAML file with a value that no line of a draft names.

    `Not read` may name a part that they are in, and a list of values is named by its first line.
    """
    lines = found.text.split("\n")
    unread = [line for line in lines if line.startswith("#   ")]
    named, left = (
        {int(one) for line in some for one in re.findall(rf"{re.escape(path)}:(\d+)", line)}
        for some in (lines, unread)
    )

    def below(node: yaml.Node, above: frozenset[int]) -> Iterator[int]:
        is_mapping = isinstance(node, yaml.MappingNode)
        for key, value in node.value if is_mapping else [(item, item) for item in node.value]:
            line = key.start_mark.line + 1
            if not isinstance(value, yaml.ScalarNode):
                yield from below(value, above | {line})
                continue
            shown = {line} if is_mapping else {line, max(above, default=0)}
            if value.value not in ("", "null") and not above & left and not shown & named:
                yield line

    root = yaml.compose(source)
    return [source.split("\n")[line - 1].strip() for line in sorted(below(root, frozenset()))]


def odd(words: Sequence[str]) -> tuple[st.SearchStrategy[object], st.SearchStrategy[object]]:
    """Single values, and values of any shape, with ``words`` among their texts and keys."""
    texts = (st.sampled_from(words), st.text(max_size=4))
    scalars: st.SearchStrategy[object] = st.one_of(
        st.none(), st.booleans(), st.integers(), st.floats(), *texts
    )
    return scalars, st.recursive(
        scalars,
        lambda inner: st.one_of(
            st.lists(inner, max_size=3), st.dictionaries(st.sampled_from(words), inner, max_size=4)
        ),
        max_leaves=12,
    )


_COUNTS = re.compile(r"(\d+) to fill in, (\d+) not read; (\d+) guess")


def todo(text: str) -> tuple[int, int, int]:
    """The counts of places to fill in, places not read and guesses in the text of a draft."""
    return text.count(" fill in: "), text.count("\n#   "), text.count("# guess: ")
