"""The severity and the texts of all rules, from the YAML files next to the rules, one file per family."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any

import yaml

FOLDER = Path(__file__).parent / "rules"
PITFALLS = Path(__file__).parent / "linter/pitfalls.yaml"
EXAMPLE = Path(__file__).parent / "linter/example.yaml"  # the base spec of every example
_THREAD = re.compile(r"([A-Za-z0-9_.-]+/[A-Za-z0-9_.-]+)#([0-9]+)")


class Severity(str, Enum):
    """An error prevents a deploy; a warning does not."""

    ERROR = "error"
    WARNING = "warning"


@dataclass(frozen=True)
class RuleText:
    """The text of one rule. ``fails`` and ``passes`` are overlays on the example swarm.

    ``threads`` are public threads in which people met the fault: ``owner/repository#number``, or a URL.
    ``manuals`` are URLs of manuals, standards and papers that describe it. A rule without both is this
    format's ``own``.
    """

    id: str
    family: str
    severity: Severity
    what: str
    why: str
    threads: tuple[str, ...]
    manuals: tuple[str, ...]
    own: bool
    fix: str
    fails: str | None
    passes: str | None
    shown: str  # why there is no example; empty if there is one
    firm: bool  # cannot be ignored: a spec with this finding cannot be used

    @property
    def links(self) -> tuple[str, ...]:
        """The threads as URLs."""
        return tuple(_THREAD.sub(r"https://github.com/\1/issues/\2", thread) for thread in self.threads)

    def to_json(self) -> dict[str, Any]:
        """Returns the entry of ``rules --format json``."""
        return {
            "id": self.id,
            "family": self.family,
            "severity": self.severity.value,
            "what": self.what,
            "why": self.why,
            "threads": list(self.links),
            "manuals": list(self.manuals),
            "own": self.own,
            "fix": self.fix,
            "fails": self.fails,
            "passes": self.passes,
            "can_be_ignored": not self.firm,
        }


@cache
def rulebook() -> Mapping[str, RuleText]:
    """Returns every rule by its id, one family after the other."""
    return {one.id: one for file in sorted(FOLDER.glob("*.yaml")) for one in _family(file)}


def example() -> str:
    """Returns the base spec of the examples as YAML text."""
    return EXAMPLE.read_text("utf-8")


def _family(file: Path) -> list[RuleText]:
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    family = yaml.load(file.read_text("utf-8"), loader)
    return [_rule(id_, family["title"], text) for id_, text in family["rules"].items()]


def _rule(id_: str, family: str, text: Mapping[str, Any]) -> RuleText:
    return RuleText(
        id=id_,
        family=family,
        severity=Severity(text.get("severity", "error")),
        what=text["what"],
        why=text["why"].strip(),
        threads=tuple(text.get("threads", ())),
        manuals=tuple(text.get("manuals", ())),
        own=text.get("own", False),
        fix=text["fix"].strip(),
        fails=text.get("fails"),
        passes=text.get("passes"),
        shown=text.get("shown", ""),
        firm=text.get("firm", False),
    )


@dataclass(frozen=True)
class Pitfall:
    """A problem that cost people days, and how swarmctl handles it."""

    number: int
    what: str
    answer: str  # rule, generator, format, health or none
    rules: tuple[str, ...]
    how: str


@cache
def pitfalls() -> tuple[Pitfall, ...]:
    """Returns the collected pitfalls in the order of their numbers."""
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    entries = yaml.load(PITFALLS.read_text("utf-8"), loader)
    return tuple(
        Pitfall(number, one["what"], one["answer"], tuple(one.get("rules", ())), one.get("how", ""))
        for number, one in entries.items()
    )
