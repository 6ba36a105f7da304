"""All rules over one document, in two rounds: names first, then what needs the names to be right."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from pathlib import Path

from swarmctl.checks import (
    addresses,
    authority,
    bauds,
    boards,
    capabilities,
    capacity,
    clocks,
    crossings,
    devices,
    identity,
    islands,
    lines,
    links,
    modes,
    multimaster,
    naming,
    network,
    ports,
    programs,
    radios,
    references,
    safety,
    security,
    settings,
    shipped,
    sketches,
    topics,
)
from swarmctl.checks.case import Case, Rule
from swarmctl.checks.fixing import Findings, Stage
from swarmctl.checks.silences import silenced
from swarmctl.spec.diagnostics import Diagnostic, has_errors, in_order
from swarmctl.spec.files import Read, content
from swarmctl.spec.limits import MAX_FINDINGS
from swarmctl.spec.load import Document, load
from swarmctl.spec.source import collector_paused
from swarmctl.topology.resolve import resolve
from swarmctl.topology.swarm import Swarm

# Names come first: the other rules look things up by them.
NAMES: tuple[Rule, ...] = (*references.NAMES, *modes.NAMES)
SENSE: tuple[Rule, ...] = (
    *references.RULES,
    *modes.RULES,
    *islands.RULES,
    *addresses.RULES,
    *network.RULES,
    *ports.RULES,
    *identity.RULES,
    *settings.RULES,
    *sketches.RULES,
    *links.RULES,
    *lines.RULES,
    *radios.RULES,
    *boards.RULES,
    *capacity.RULES,
    *devices.RULES,
    *bauds.RULES,
    *clocks.RULES,
    *programs.RULES,
    *capabilities.RULES,
    *shipped.RULES,
    *naming.RULES,
    *topics.RULES,
    *multimaster.RULES,
    *crossings.RULES,
    *authority.RULES,
    *safety.RULES,
    *security.RULES,
)


def check(document: Document, told: Sequence[Diagnostic] = ()) -> tuple[Diagnostic, ...]:
    """Every finding of every rule, and of those ``told`` by the reader, that is not silenced, in order."""
    return _examined(document, told).diagnostics


def _examined(document: Document, told: Sequence[Diagnostic]) -> Findings:
    case = Case(document)
    found = [*told, *(finding for rule in NAMES for finding in islice(rule(case), MAX_FINDINGS))]
    stage = Stage.NAMES if has_errors(found) else Stage.SENSE
    if stage is Stage.SENSE:
        found += [finding for rule in SENSE for finding in islice(rule(case), MAX_FINDINGS)]
        found = list(silenced(found, document, document.source.texts))
    return Findings(stage, in_order(found))


def look(layers: Sequence[Path], read: Read = content) -> Findings:
    """What is to be said about a spec and what is laid over it, and how far it could be looked at."""
    document, diagnostics = load(layers, read)
    if document is not None:
        return _examined(document, diagnostics)
    unread = any(one.code.startswith(("FILE", "YAML")) for one in diagnostics if has_errors([one]))
    return Findings(Stage.TEXT if unread else Stage.VOCABULARY, in_order(diagnostics))


def examine(*layers: Path) -> tuple[Document | None, tuple[Diagnostic, ...]]:
    """A spec, and what is laid over it, to one document and warnings, or to errors."""
    with collector_paused():
        document, diagnostics = load(layers)
        if document is None:
            return None, in_order(diagnostics)
        found = check(document, diagnostics)
        return None if has_errors(found) else document, found


def read(*layers: Path) -> tuple[Swarm | None, tuple[Diagnostic, ...]]:
    """A spec, and what is laid over it, to the resolved swarm and warnings, or to errors."""
    with collector_paused():
        document, found = examine(*layers)
        return None if document is None else resolve(document), found
