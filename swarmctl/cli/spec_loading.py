"""Loads a spec for a verb: fetches the git commits of its packages that are missing, then checks it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from swarmctl.cli.spec_args import SpecFiles
    from swarmctl.deploy.git_fetch import GitFetchError
    from swarmctl.diagnostics import Diagnostic
    from swarmctl.rules.fixes import Findings
    from swarmctl.spec.load import Document


def loaded(spec: SpecFiles) -> tuple[Document | None, Findings]:
    """Returns the document of a spec with its findings; a commit that cannot be fetched is one, with why."""
    from swarmctl.rules.runner import check_files

    document, found = check_files(*spec.files, workspaces=spec.workspaces)
    if not any(map(_is_missing, found.diagnostics)):
        return document, found
    from swarmctl.deploy.git_fetch import fetch_missing

    failed = fetch_missing(spec.files)
    document, found = check_files(*spec.files, workspaces=spec.workspaces)
    explained = (_explained(one, failed) if _is_missing(one) else one for one in found.diagnostics)
    return document, replace(found, diagnostics=tuple(explained))


def _is_missing(found: Diagnostic) -> bool:
    from swarmctl.spec.git_checkouts import NOT_FETCHED

    return found.code == "PKG017" and found.message.endswith(NOT_FETCHED)


def _explained(found: Diagnostic, failed: Mapping[str, GitFetchError]) -> Diagnostic:
    reasons = [error for start, error in failed.items() if found.message.startswith(f"`{start}")]
    return replace(found, help=(f"{reasons[0]}; {reasons[0].fix}",)) if reasons else found
