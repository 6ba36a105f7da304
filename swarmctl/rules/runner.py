"""Runs all rules on one document: references first, then the rules that need valid references."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from types import ModuleType

from swarmctl.diagnostics import Diagnostic, has_errors, in_order
from swarmctl.rules.context import Rule, RuleContext
from swarmctl.rules.families.authority import rules as authority
from swarmctl.rules.families.bluetooth import rules as bluetooth
from swarmctl.rules.families.boards import rosserial, sketches
from swarmctl.rules.families.capacity import rules as capacity
from swarmctl.rules.families.devices import bauds, board_ports, devices, links
from swarmctl.rules.families.identity import rules as identity
from swarmctl.rules.families.modes import islands
from swarmctl.rules.families.modes import rules as modes
from swarmctl.rules.families.multimaster import bridged_topics, discovery
from swarmctl.rules.families.naming import remaps
from swarmctl.rules.families.naming import rules as naming
from swarmctl.rules.families.network import addresses, reachability
from swarmctl.rules.families.packages import executables, launch_files, launched_nodes, messages
from swarmctl.rules.families.packages import names as package_names
from swarmctl.rules.families.ports import rules as ports
from swarmctl.rules.families.programs import capabilities, declarations, gamepads, shipped, values
from swarmctl.rules.families.references import rules as references
from swarmctl.rules.families.safety import rules as safety
from swarmctl.rules.families.security import rules as security
from swarmctl.rules.families.serial_lines import rules as serial_lines
from swarmctl.rules.families.settings import rules as settings
from swarmctl.rules.families.time import rules as time
from swarmctl.rules.families.topics import message_types, sources
from swarmctl.rules.families.topics import rules as topics
from swarmctl.rules.fixes import Findings, Stage
from swarmctl.rules.suppressions import apply_suppressions
from swarmctl.spec.load import Document, load
from swarmctl.spec.package_search import Search, packages_in
from swarmctl.swarm.resolve import resolve
from swarmctl.swarm.resolved import Swarm
from swarmctl.yamltext.files import Read, content
from swarmctl.yamltext.limits import MAX_FINDINGS
from swarmctl.yamltext.source import collector_paused

_MODULES: tuple[ModuleType, ...] = (
    references,
    modes,
    islands,
    addresses,
    reachability,
    ports,
    identity,
    settings,
    sketches,
    links,
    serial_lines,
    bluetooth,
    rosserial,
    capacity,
    devices,
    bauds,
    board_ports,
    time,
    declarations,
    capabilities,
    shipped,
    gamepads,
    values,
    executables,
    launch_files,
    launched_nodes,
    package_names,
    messages,
    naming,
    remaps,
    topics,
    sources,
    message_types,
    discovery,
    bridged_topics,
    authority,
    safety,
    security,
)
RULES = tuple(one for module in _MODULES for one in vars(module).values() if isinstance(one, Rule))


def lint(document: Document, reported: Sequence[Diagnostic] = ()) -> tuple[Diagnostic, ...]:
    """Returns the findings of all rules in text order, without suppressed ones.

    ``reported`` are findings from loading the document; they can be suppressed too.
    """
    return _lint(document, reported).diagnostics


def _lint(document: Document, reported: Sequence[Diagnostic]) -> Findings:
    context = RuleContext(document)
    found = [
        *reported,
        *(finding for rule in RULES if rule.names for finding in islice(rule(context), MAX_FINDINGS)),
    ]
    stage = Stage.NAMES if has_errors(found) else Stage.RULES
    if stage is Stage.RULES:
        found += [
            finding for rule in RULES if not rule.names for finding in islice(rule(context), MAX_FINDINGS)
        ]
        found = list(apply_suppressions(found, document, document.source.texts))
    return Findings(stage, in_order(found))


def lint_files(
    layers: Sequence[Path],
    read: Read = content,
    workspaces: Sequence[Path] = (),
    search: Search = packages_in,
) -> Findings:
    """Loads a spec with its overlays and runs all rules.

    Returns the findings and the last stage that was checked. ``read`` returns the bytes of a file.
    """
    document, diagnostics = load(layers, read, workspaces, search)
    if document is not None:
        return _lint(document, diagnostics)
    unread = any(one.code.startswith(("FILE", "YAML")) for one in diagnostics if has_errors([one]))
    return Findings(Stage.TEXT if unread else Stage.FORMAT, in_order(diagnostics))


def load_checked(
    *layers: Path, workspaces: Sequence[Path] = ()
) -> tuple[Document | None, tuple[Diagnostic, ...]]:
    """Loads a spec with its overlays and runs all rules; ``workspaces`` have ROS packages, too.

    Returns the document, or None if there are errors, and the findings in text order.
    """
    with collector_paused():
        document, diagnostics = load(layers, workspaces=workspaces)
        if document is None:
            return None, in_order(diagnostics)
        found = lint(document, diagnostics)
        return None if has_errors(found) else document, found


def load_swarm(*layers: Path) -> tuple[Swarm | None, tuple[Diagnostic, ...]]:
    """Like `load_checked`, but returns the resolved swarm instead of the document."""
    with collector_paused():
        document, found = load_checked(*layers)
        return None if document is None else resolve(document), found
