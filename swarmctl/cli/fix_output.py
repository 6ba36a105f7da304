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
    from swarmctl.rules.fixes import Fixed


def apply_fixes(specs: Iterable[SpecFiles], *, unsafe: bool, quiet: bool) -> None:
    """Write the files of specs with all fixes that can be applied, and print each fix."""
    from swarmctl.views.escape import printable

    for spec in specs:
        fixed, changes = _changes(spec, unsafe=unsafe)
        for change in changes:
            file_writes.write(change)
        for found in fixed.made if not quiet else ():
            title = found.fix.title if found.fix else ""
            console.err().print(printable(f"fixed {found.code} {found.span}: {title}"))


def show_diffs(specs: Iterable[SpecFiles], *, unsafe: bool) -> bool:
    """Print the changes that ``--fix`` would make; True if there are any."""
    changes = [change for spec in specs for change in _changes(spec, unsafe=unsafe)[1]]
    for change in changes:
        sys.stdout.write(file_writes.difference(change))
    return bool(changes)


def _changes(spec: SpecFiles, *, unsafe: bool) -> tuple[Fixed, list[Change]]:
    """The fixes and the changes to the files."""
    files = SpecFixes(spec)
    fixable = files.fixable()
    fixed = fixable.all if unsafe else fixable.safe
    changes = [
        Change(files.read(Path(file)), file, files.original(file), text) for file, text in fixed.texts.items()
    ]
    return fixed, [change for change in changes if change.before != change.after]
