"""What the files of a lab are that a draft has nothing of."""

from __future__ import annotations

import posixpath
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping

_KINDS = tuple(
    (re.compile(pattern), what)
    for pattern, what in (
        (r"(^|/)package\.xml$", "package manifest"),
        (r"\.(urdf|xacro)(\.xml)?$", "robot description"),
        (r"\.(world|sdf)(\.xml)?$", "world of a simulator"),
        (r"\.rviz$", "file of RViz"),
        (r"\.(bag|db3|mcap)$", "recording"),
        (r"\.(msg|srv|action|idl)$", "interface of ROS"),
        (r"\.(c|cc|cpp|cxx|h|hh|hpp|ino)$", "C or C++ source"),
        (r"\.launch(\.xml)?$", "launch file"),
        (r"launch[^/]*\.py$", "Python file without a launch description"),
        (r"\.py$", "Python file"),
        (r"(^|/)[^/]*Dockerfile[^/]*$", "Dockerfile"),
        (r"\.j2$", "template"),
        (r"(^|/)([Jj]ust|[Mm]ake)file$", "list of commands"),
        (r"\.(service|timer)$", "unit of systemd"),
        (r"\.(sh|bash|zsh|env)$", "script"),
        (r"\.(md|rst|txt|pdf)$", "text to read"),
        (r"\.(ya?ml|json)$", "YAML file"),
        (r"\.xml$", "XML file"),
    )
)  # the first one that fits
_PARAMETERS = re.compile(r"^\s+\"?ros__parameters\"?\s*:", re.MULTILINE)
_MOST = 8  # kinds in one message


def what_it_is(path: str, text: str = "") -> str:
    """Returns what a file is, by its name and, if it is at hand, its text."""
    if _PARAMETERS.search(text):
        return "parameter file of ROS 2"
    return next((what for pattern, what in _KINDS if pattern.search(path)), "other file")


def counted(paths: Iterable[str], texts: Mapping[str, str]) -> str:
    """Returns how many files of each kind there are: "3 robot descriptions, 1 recording"."""
    counts = Counter(what_it_is(one, texts.get(one, "")) for one in paths)
    first = sorted(counts.items(), key=lambda one: (-one[1], one[0]))[:_MOST]
    return ", ".join(f"{count} {_several(what) if count > 1 else what}" for what, count in first)


def unused(paths: Iterable[str], texts: Mapping[str, str]) -> Iterator[str]:
    """Yields a line for the files of each kind and folder that a draft has nothing of."""
    groups: dict[tuple[str, str], list[str]] = {}
    for one in sorted(paths):
        groups.setdefault((what_it_is(one, texts.get(one, "")), posixpath.dirname(one)), []).append(one)
    for (what, _), found in groups.items():
        yield f"{', '.join(found)}: {_several(what) if found[1:] else what} of which nothing is read"


def _several(what: str) -> str:
    """The plural: of the last word before `of`, `without` or `to`."""
    head, rest = re.match(r"(.*?)( (?:of|without|to) .*)?$", what).groups("")  # type: ignore[union-attr]
    return f"{head}s{rest}"
