"""The fixes of one spec's files, tried in memory: what ``--fix`` writes and what a summary counts."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from swarmctl.cli.spec_args import SpecFiles
    from swarmctl.diagnostics import Diagnostic
    from swarmctl.linter.fixes import Findings, Fixable, Fixed, Texts
    from swarmctl.spec.load import Document
    from swarmctl.views.findings.report import Checked


def checked(spec: SpecFiles) -> Checked:
    """The findings in a spec, and how many ``--fix`` and ``--unsafe-fixes`` would correct."""
    from swarmctl.linter.runner import check_files

    return with_fixes_counted(spec, *check_files(*spec.files, workspaces=spec.workspaces))


def with_fixes_counted(spec: SpecFiles, document: Document | None, found: Findings) -> Checked:
    """Like `checked`, of a spec that is loaded. What only the safe fixes show is among the findings."""
    from dataclasses import replace

    from swarmctl.diagnostics import in_order
    from swarmctl.linter.fixes import Stage
    from swarmctl.views.findings.report import Checked

    if all(one.fix is None for one in found.diagnostics):
        return Checked(str(spec), document, found.diagnostics)
    fixable = SpecFixes(spec).fixable(found)
    behind = fixable.safe.behind(found.diagnostics) if found.stage < Stage.RULES else ()
    # a fix that would make the spec worse is not made, so it is not offered either
    left = {(one.code, one.message) for one in fixable.all.left if one.fix is not None}
    left -= {(one.code, one.message) for one in fixable.all.made}
    offered = (
        replace(one, fix=None) if (one.code, one.message) in left else one for one in found.diagnostics
    )
    shown = in_order((*offered, *behind))
    safe, every = (_corrected(shown, fixed) for fixed in (fixable.safe, fixable.all))
    return Checked(str(spec), document, shown, safe, every - safe)


def _corrected(found: Iterable[Diagnostic], fixed: Fixed) -> int:
    """Counts the findings whose fix is made; several may have the same fix."""

    def change(one: Diagnostic) -> tuple[str, str, frozenset[str]] | None:
        edits = one.fix.edits if one.fix else ()
        return (one.code, one.fix.title, frozenset(edit.span.file for edit in edits)) if one.fix else None

    made, fixes = set(map(change, fixed.made)), {one.fix for one in fixed.made}
    return sum(one.fix is not None and (one.fix in fixes or change(one) in made) for one in found)


class SpecFixes:
    """The files of a spec, each read once, and what their fixes do."""

    def __init__(self, spec: SpecFiles) -> None:
        from swarmctl.spec.package_search import packages_in
        from swarmctl.yamltext.files import content

        self._spec = spec
        self._search = cache(packages_in)
        self.read = cache(content)

    def original(self, file: str) -> str:
        """Returns the text of a file, without byte order mark."""
        return self.read(Path(file)).decode("utf-8-sig")

    def fixable(self, found: Findings | None = None) -> Fixable:
        """Returns the texts with fixes, and those of the findings (``found``, if known) that they correct."""
        from swarmctl.linter.fixes import fixable

        return fixable(self.found_with, self.original, found)

    def found_with(self, texts: Texts) -> Findings:
        """Returns the findings with other texts in place of those of some files."""
        return self.checked_with(texts)[1]

    def checked_with(self, texts: Texts) -> tuple[Document | None, Findings]:
        """Returns the document as well; None if there are errors."""
        from swarmctl.linter.runner import check_files

        changed = {Path(file): text.encode() for file, text in texts.items()}
        return check_files(
            *self._spec.files,
            workspaces=self._spec.workspaces,
            read=lambda path: changed[path] if path in changed else self.read(path),
            search=self._search,
        )
