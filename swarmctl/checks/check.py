"""All rules over one document, in two rounds: names first, then what needs the names to be right."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from swarmctl.checks import identity, links, modes, references, settings
from swarmctl.spec.diagnostics import Diagnostic, has_errors, in_order
from swarmctl.spec.load import Document, load
from swarmctl.spec.source import collector_paused
from swarmctl.topology.resolve import resolve
from swarmctl.topology.swarm import Swarm

Rule = Callable[[Document], Iterator[Diagnostic]]

NAMES: tuple[Rule, ...] = (references.unknown_names, modes.role_named, modes.robots_have_hosts)
SENSE: tuple[Rule, ...] = (
    modes.ready_modes,
    references.circular_jumps,
    modes.programs_wait,
    identity.loopback_addresses,
    identity.unfit_addresses,
    identity.doubled_addresses,
    identity.doubled_devices,
    identity.doubled_bluetooth,
    identity.doubled_networks,
    identity.doubled_namespaces,
    identity.reserved_names,
    settings.unreachable_limits,
    links.robot_lines,
    links.line_details,
    links.spoken_lines,
    links.adapters,
    links.paths_to_hub,
)


def check(document: Document) -> tuple[Diagnostic, ...]:
    """Every finding of every rule, in the order of the text."""
    found = [finding for rule in NAMES for finding in rule(document)]
    if not has_errors(found):
        found += [finding for rule in SENSE for finding in rule(document)]
    return in_order(found)


def read(path: Path) -> tuple[Swarm | None, tuple[Diagnostic, ...]]:
    """A spec file to the resolved swarm; with errors there is none. Warnings come along with it."""
    with collector_paused():
        document, diagnostics = load(path)
        if document is None:
            return None, in_order(diagnostics)
        found = check(document)
        if has_errors(found):
            return None, found
        return resolve(document), found
