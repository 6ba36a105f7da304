"""Runs all rules on one document: references first, then the rules that need valid references.

A spec with errors is checked by `one_round`.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from types import ModuleType

from swarmctl.diagnostics import Diagnostic, has_errors, in_order
from swarmctl.rules.context import Rule, RuleContext
from swarmctl.rules.families.authority import rules as authority
from swarmctl.rules.families.bluetooth import crazyradios
from swarmctl.rules.families.bluetooth import rules as bluetooth
from swarmctl.rules.families.boards import rosserial, sketches
from swarmctl.rules.families.capacity import rules as capacity
from swarmctl.rules.families.devices import bauds, board_ports, devices, ip_links, links, placeholders
from swarmctl.rules.families.drivers import rules as drivers
from swarmctl.rules.families.identity import rules as identity
from swarmctl.rules.families.modes import islands
from swarmctl.rules.families.modes import rules as modes
from swarmctl.rules.families.multimaster import bridged_masters, bridged_nodes, bridged_topics, discovery
from swarmctl.rules.families.naming import groups, namespaces, remaps
from swarmctl.rules.families.naming import rules as naming
from swarmctl.rules.families.network import addresses, reachability
from swarmctl.rules.families.packages import (
    delivered,
    executables,
    interpreters,
    launch_files,
    launched_nodes,
    launched_robots,
    messages,
)
from swarmctl.rules.families.packages import names as package_names
from swarmctl.rules.families.ports import rules as ports
from swarmctl.rules.families.programs import (
    capabilities,
    declarations,
    files,
    gamepads,
    privileges,
    recordings,
    shipped,
    starts,
    values,
)
from swarmctl.rules.families.references import rules as references
from swarmctl.rules.families.robot_descriptions import rules as robot_descriptions
from swarmctl.rules.families.safety import rules as safety
from swarmctl.rules.families.security import rules as security
from swarmctl.rules.families.sense import rules as sense
from swarmctl.rules.families.serial_lines import rules as serial_lines
from swarmctl.rules.families.settings import rules as settings
from swarmctl.rules.families.settings import unmeasured_terms
from swarmctl.rules.families.time import rules as time
from swarmctl.rules.families.time import simulated
from swarmctl.rules.families.topics import absolute_topics, message_types, sources, subscribers
from swarmctl.rules.families.topics import rules as topics
from swarmctl.rules.fixes import Findings, Stage
from swarmctl.rules.one_round import all_at_once
from swarmctl.rules.suppressions import apply_suppressions
from swarmctl.spec.load import Document, Draft, document_of, draft_from, draft_of
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
    unmeasured_terms,
    sense,
    sketches,
    links,
    placeholders,
    ip_links,
    drivers,
    robot_descriptions,
    serial_lines,
    bluetooth,
    crazyradios,
    rosserial,
    capacity,
    devices,
    bauds,
    board_ports,
    time,
    simulated,
    declarations,
    starts,
    files,
    capabilities,
    shipped,
    gamepads,
    privileges,
    recordings,
    values,
    delivered,
    executables,
    interpreters,
    launch_files,
    launched_nodes,
    launched_robots,
    package_names,
    messages,
    naming,
    namespaces,
    groups,
    remaps,
    topics,
    absolute_topics,
    subscribers,
    sources,
    message_types,
    discovery,
    bridged_masters,
    bridged_nodes,
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
    return _lint(document, reported, draft_from(document, reported)).diagnostics


def _lint(document: Document, reported: Sequence[Diagnostic], draft: Draft) -> Findings:
    context = RuleContext(document)
    found = [
        *reported,
        *(finding for rule in RULES if rule.names for finding in islice(rule(context), MAX_FINDINGS)),
    ]
    if has_errors(found):
        return Findings(Stage.NAMES, all_at_once(draft, RULES))
    found += [finding for rule in RULES if not rule.names for finding in islice(rule(context), MAX_FINDINGS)]
    return Findings(Stage.RULES, in_order(apply_suppressions(found, document, document.texts)))


def lint_files(
    layers: Sequence[Path],
    read: Read = content,
    workspaces: Sequence[Path] = (),
    search: Search = packages_in,
) -> Findings:
    """Loads a spec with its overlays and runs all rules.

    Returns the findings and the first stage that has errors. ``read`` returns the bytes of a file.
    """
    return _check(draft_of(layers, read, workspaces, search))[1]


def load_checked(
    *layers: Path, workspaces: Sequence[Path] = ()
) -> tuple[Document | None, tuple[Diagnostic, ...]]:
    """Loads a spec with its overlays and runs all rules; ``workspaces`` have ROS packages, too.

    Returns the document, or None if there are errors, and the findings in text order.
    """
    document, found = check_files(*layers, workspaces=workspaces)
    return document, found.diagnostics


def check_files(
    *layers: Path, workspaces: Sequence[Path] = (), read: Read = content, search: Search = packages_in
) -> tuple[Document | None, Findings]:
    """Like `load_checked`; the findings are with the first stage that has errors."""
    with collector_paused():
        document, found = _check(draft_of(layers, read, workspaces, search))
        return None if has_errors(found.diagnostics) else document, found


def _check(draft: Draft) -> tuple[Document | None, Findings]:
    """Returns the document and its findings; after an error, those of all rules on what is right."""
    document, diagnostics = document_of(draft)
    if document is not None:
        return document, _lint(document, diagnostics, draft)
    unread = any(one.code.startswith(("FILE", "YAML")) for one in diagnostics if has_errors([one]))
    return None, Findings(Stage.TEXT if unread else Stage.FORMAT, all_at_once(draft, RULES))


def load_swarm(*layers: Path) -> tuple[Swarm | None, tuple[Diagnostic, ...]]:
    """Like `load_checked`, but returns the resolved swarm instead of the document."""
    with collector_paused():
        document, found = load_checked(*layers)
        return None if document is None else resolve(document), found
