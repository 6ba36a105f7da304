"""Programs that run `rosbag record`: their words, and which topics these select. Pure."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from swarmctl.robot_types.ros_launchable import PlaceholderError, filled
from swarmctl.spec.program_model import Program
from swarmctl.swarm import names

# Options of rosbag 1.15 that have a value; a short one may have it attached, as `-O/tmp/a`.
_SHORT_WITH_VALUE = "xoObl"
_LONG_WITH_VALUE = {
    *("exclude", "output-prefix", "output-name", "max-splits", "size", "duration", "buffsize"),
    *("chunksize", "limit", "node"),
}
_SHORT = {"a": "all", "e": "regex", "x": "exclude"}
# Expressions that match quickly have no repeated group and few repetitions in each alternative.
_REPEATED_GROUP = re.compile(r"\)[*+{]")
_REPETITION = re.compile(r"[*+{]")
_MOST_REPETITIONS = 3


@dataclass(frozen=True)
class Recording:
    """The topics that a `rosbag record` selects."""

    everything: bool
    topics: frozenset[str]
    patterns: tuple[re.Pattern[str], ...]
    excluded: re.Pattern[str] | None

    def takes(self, topic: str) -> bool:
        """Returns whether ``topic``, a full name, is recorded; `--exclude` does not affect named topics."""
        if topic in self.topics:
            return True
        if self.excluded is not None and self.excluded.fullmatch(topic):
            return False
        return self.everything or any(one.fullmatch(topic) for one in self.patterns)


def record_words(program: Program) -> tuple[str, Sequence[str]]:
    """Returns the key and the words of a `rosbag record`; no words of other programs."""
    words = program.command or ()
    basenames = [posixpath.basename(word) for word in words]
    if ("rosbag", "record") in pairwise(basenames):
        return "command", words
    if (program.package, program.executable) == ("rosbag", "record") and isinstance(program.args, tuple):
        return "args", program.args
    return "", ()


def recording_of(program: Program, node: str, values: Mapping[str, str]) -> Recording | None:
    """Returns what ``program`` records; None if it is no `rosbag record`.

    ``node`` is its full name, below whose namespace its topics are, ``values`` are those of placeholders.
    """
    key, words = record_words(program)
    if not key:
        return None
    if key == "command":
        words = words[[posixpath.basename(word) for word in words].index("record") + 1 :]
    options, given = _parsed([_with_values(word, values) for word in words])
    regex = "regex" in options and "all" not in options
    return Recording(
        "all" in options,
        frozenset() if regex else frozenset(names.resolved(one, node, {}) for one in given),
        tuple(one for one in map(_pattern, given) if one is not None) if regex else (),
        _pattern(options["exclude"]) if "exclude" in options else None,
    )


def _with_values(word: str, values: Mapping[str, str]) -> str:
    try:
        return str(filled(word, values))
    except PlaceholderError:
        return word


def _parsed(words: Sequence[str]) -> tuple[dict[str, str], list[str]]:
    """Returns the options, by long name, and the other words."""
    options: dict[str, str] = {}
    given: list[str] = []
    rest = iter(words)
    for word in rest:
        if word.startswith("--"):
            name, equals, value = word[2:].partition("=")
            options[name] = next(rest, "") if name in _LONG_WITH_VALUE and not equals else value
        elif word.startswith("-"):
            for at, letter in enumerate(word[1:], 2):
                takes_value = letter in _SHORT_WITH_VALUE
                options[_SHORT.get(letter, letter)] = (word[at:] or next(rest, "")) if takes_value else ""
                if takes_value:
                    break
        elif not word.isdigit():  # `--split 1024`, as it was once written
            given.append(word)
    return options, given


def _pattern(text: str) -> re.Pattern[str] | None:
    """Returns the compiled expression; None if it is not valid or its matching could take long."""
    repetitions = max(len(_REPETITION.findall(one)) for one in text.split("|"))
    if _REPEATED_GROUP.search(text) or repetitions > _MOST_REPETITIONS:
        return None
    try:
        return re.compile(text)
    except re.error:
        return None
