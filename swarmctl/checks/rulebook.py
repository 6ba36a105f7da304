"""What each rule is for, in words: read from the YAML files beside the rules, one file a family."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from swarmctl.spec.diagnostics import Severity

FOLDER = Path(__file__).parent / "rules"
PITFALLS = Path(__file__).parent / "pitfalls.yaml"
EXAMPLE = "example.yaml"  # the swarm that every example of a rule changes
# A file each, as one reads a spec: the text, who is there, what joins them, what runs, who may do what.
FAMILIES = (
    *("files", "several-files", "ranges", "references", "modes", "identity", "network", "ports", "time"),
    *("security", "devices", "lines", "radios", "capacity", "programs", "naming", "topics", "boards"),
    *("multimaster", "authority", "safety", "settings", "silences"),
)
_THREAD = re.compile(r"([A-Za-z0-9_.-]+/[A-Za-z0-9_.-]+)#([0-9]+)")


@dataclass(frozen=True)
class RuleText:
    """One rule in words. ``fails`` and ``passes`` are overlays on the example swarm."""

    id: str
    family: str
    severity: Severity
    what: str
    why: str
    threads: tuple[str, ...]
    mend: str
    fails: str | None
    passes: str | None
    shown: str  # why there are no examples, where there are none
    firm: bool  # cannot be silenced: nothing sensible could be made of the spec

    @property
    def links(self) -> tuple[str, ...]:
        """The threads as addresses that a browser opens."""
        return tuple(_THREAD.sub(r"https://github.com/\1/issues/\2", thread) for thread in self.threads)

    def to_json(self) -> dict[str, Any]:
        return {
            "id": self.id,
            "family": self.family,
            "severity": self.severity.value,
            "what": self.what,
            "why": self.why,
            "threads": list(self.links),
            "mend": self.mend,
            "fails": self.fails,
            "passes": self.passes,
            "can_be_silenced": not self.firm,
        }


@cache
def rulebook() -> Mapping[str, RuleText]:
    """Every rule by its id, in the order of the families and of their entries."""
    files = [file for file in FOLDER.glob("*.yaml") if file.name != EXAMPLE]
    in_order = sorted(files, key=lambda file: FAMILIES.index(file.stem))
    return {one.id: one for file in in_order for one in _family(file)}


def example() -> str:
    """The text of the swarm that the examples change."""
    return (FOLDER / EXAMPLE).read_text("utf-8")


def _family(file: Path) -> list[RuleText]:
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    family = yaml.load(file.read_text("utf-8"), loader)
    return [_rule(id_, family["title"], text) for id_, text in family["rules"].items()]


def _rule(id_: str, family: str, text: Mapping[str, Any]) -> RuleText:
    return RuleText(
        id=id_,
        family=family,
        severity=Severity(text["severity"]),
        what=text["what"],
        why=text["why"].strip(),
        threads=tuple(text.get("threads", ())),
        mend=text["mend"].strip(),
        fails=text.get("fails"),
        passes=text.get("passes"),
        shown=text.get("shown", ""),
        firm=text.get("firm", False),
    )


@dataclass(frozen=True)
class Pitfall:
    """Something that has cost people days, and what becomes of it here."""

    number: int
    what: str
    answer: str  # rule, generator, vocabulary, health or not
    rules: tuple[str, ...]
    how: str


@cache
def pitfalls() -> tuple[Pitfall, ...]:
    """The collected pitfalls, by number."""
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    entries = yaml.load(PITFALLS.read_text("utf-8"), loader)
    return tuple(
        Pitfall(number, one["what"], one["answer"], tuple(one.get("rules", ())), one.get("how", ""))
        for number, one in entries.items()
    )
