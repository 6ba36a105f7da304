"""``validate --fix`` and ``--diff``: writes or shows the fixes of the findings."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from swarmctl.cli import console, file_writes
from swarmctl.cli.file_writes import Change
from swarmctl.cli.spec_fixes import SpecFixes

if TYPE_CHECKING:
    from swarmctl.cli.spec_args import SpecFiles
    from swarmctl.linter.fixes import Fixable, Fixed


def apply_fixes(specs: Iterable[SpecFiles], *, unsafe: bool, quiet: bool) -> None:
    """Write the files of specs with all fixes that can be applied, and print each fix."""
    from swarmctl.views.escape import printable

    for spec in specs:
        fixable, changes = _changes(spec, unsafe=unsafe)
        file_writes.write(changes)
        for found in _chosen(fixable, unsafe=unsafe).made if not quiet else ():
            title = found.fix.title if found.fix else ""
            console.err().print(printable(f"fixed {found.code} {found.span}: {title}"))


def show_diffs(specs: Iterable[SpecFiles], *, unsafe: bool) -> bool:
    """Print the changes that ``--fix`` would make; True if there are any."""
    from swarmctl.views.escape import printable

    some = False
    for spec in specs:
        fixable, changes = _changes(spec, unsafe=unsafe)
        for change in changes:
            sys.stdout.write(file_writes.difference(change))
        if not changes and fixable.all.made:
            console.err().print(printable(f"{spec}: no safe fix; `--unsafe-fixes --diff` shows the guesses"))
        some = some or bool(changes)
    return some


def _chosen(fixable: Fixable, *, unsafe: bool) -> Fixed:
    return fixable.all if unsafe else fixable.safe


def _changes(spec: SpecFiles, *, unsafe: bool) -> tuple[Fixable, list[Change]]:
    """The fixes and the changes to the files."""
    files = SpecFixes(spec)
    fixable = files.fixable()
    texts = _chosen(fixable, unsafe=unsafe).texts
    changes = [
        Change(files.read(Path(file)), file, files.original(file), text) for file, text in texts.items()
    ]
    return fixable, [change for change in changes if change.before != change.after]
