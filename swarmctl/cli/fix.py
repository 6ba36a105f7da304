"""``validate --fix`` and ``--diff``: what the findings' fixes make of the files, written or shown."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from swarmctl.cli import console, rewriting
from swarmctl.cli.rewriting import Change

if TYPE_CHECKING:
    from swarmctl.cli.layers import Layers
    from swarmctl.spec.diagnostics import Diagnostic


def apply_fixes(specs: Iterable[Layers], *, quiet: bool) -> None:
    """Write the files of specs with every fix that can be applied, and say what was fixed."""
    from swarmctl.views.text import printable

    for spec in specs:
        made, changes = _fixed(spec)
        for change in changes:
            rewriting.write(change)
        for found in made if not quiet else ():
            title = found.fix.title if found.fix else ""
            console.err().print(printable(f"fixed {found.code} {found.span}: {title}"))


def show_diffs(specs: Iterable[Layers]) -> bool:
    """Print what ``--fix`` would change, and say whether there is something."""
    changes = [change for spec in specs for change in _fixed(spec)[1]]
    for change in changes:
        sys.stdout.write(rewriting.difference(change))
    return bool(changes)


def _fixed(spec: Layers) -> tuple[tuple[Diagnostic, ...], list[Change]]:
    """What was fixed, and what becomes of the files. Each of them is read once."""
    from swarmctl.checks.check import look
    from swarmctl.checks.fixing import Findings, Texts, fixed
    from swarmctl.spec.files import content

    read = cache(content)

    def with_texts(texts: Texts) -> Findings:
        return look(spec.files, lambda path: texts[str(path)].encode() if str(path) in texts else read(path))

    def original(file: str) -> str:
        return read(Path(file)).decode("utf-8-sig")

    found = fixed(with_texts, original)
    changes = [Change(read(Path(file)), file, original(file), text) for file, text in found.texts.items()]
    return found.made, changes
