"""Loads a spec with its overlays, as the verbs do."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from swarmctl.diagnostics import Diagnostic
from swarmctl.linter.fixes import Findings
from swarmctl.linter.runner import check_files
from swarmctl.spec.load import Document
from swarmctl.spec.package_search import Search, packages_in
from swarmctl.swarm.resolve import resolve
from swarmctl.swarm.resolved import Swarm
from swarmctl.yamltext.files import Read
from swarmctl.yamltext.source import collector_paused


def load_checked(
    *layers: Path, workspaces: Sequence[Path] = ()
) -> tuple[Document | None, tuple[Diagnostic, ...]]:
    """The document, or None if it has errors, and the findings in text order."""
    document, found = check_files(*layers, workspaces=workspaces)
    return document, found.diagnostics


def load_swarm(*layers: Path) -> tuple[Swarm | None, tuple[Diagnostic, ...]]:
    """Like `load_checked`, but the resolved swarm instead of the document."""
    with collector_paused():
        document, found = load_checked(*layers)
        return None if document is None else resolve(document), found


def lint_files(
    layers: Sequence[Path], read: Read, workspaces: Sequence[Path] = (), search: Search = packages_in
) -> Findings:
    """The findings of a spec whose files ``read`` returns."""
    return check_files(*layers, workspaces=workspaces, read=read, search=search)[1]
