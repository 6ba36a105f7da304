"""``validate --fix`` and ``--diff``: writes or shows the fixes of the findings."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from swarmctl.cli import console, file_writes
from swarmctl.cli.file_writes import Change

if TYPE_CHECKING:
    from swarmctl.cli.spec_args import SpecFiles
    from swarmctl.diagnostics import Diagnostic


def apply_fixes(specs: Iterable[SpecFiles], *, quiet: bool) -> None:
    """Write the files of specs with all fixes that can be applied, and print each fix."""
    from swarmctl.views.escape import printable

    for spec in specs:
        made, changes = _fixed(spec)
        for change in changes:
            file_writes.write(change)
        for found in made if not quiet else ():
            title = found.fix.title if found.fix else ""
            console.err().print(printable(f"fixed {found.code} {found.span}: {title}"))


def show_diffs(specs: Iterable[SpecFiles]) -> bool:
    """Print the changes that ``--fix`` would make; True if there are any."""
    changes = [change for spec in specs for change in _fixed(spec)[1]]
    for change in changes:
        sys.stdout.write(file_writes.difference(change))
    return bool(changes)


def _fixed(spec: SpecFiles) -> tuple[tuple[Diagnostic, ...], list[Change]]:
    """The applied findings and the changes to the files. Each file is read once."""
    from swarmctl.rules import fixes
    from swarmctl.rules.runner import lint_files
    from swarmctl.yamltext.files import content

    read = cache(content)

    def with_texts(texts: fixes.Texts) -> fixes.Findings:
        changed = {Path(file): text.encode() for file, text in texts.items()}
        return lint_files(spec.files, lambda path: changed[path] if path in changed else read(path))

    def original(file: str) -> str:
        return read(Path(file)).decode("utf-8-sig")

    found = fixes.apply_fixes(with_texts, original)
    changes = [Change(read(Path(file)), file, original(file), text) for file, text in found.texts.items()]
    return found.made, changes
