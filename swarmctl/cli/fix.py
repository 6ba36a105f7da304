"""``validate --fix`` and ``--diff``: what the findings' fixes make of the files, written or shown."""

from __future__ import annotations

import codecs
import difflib
import os
import shutil
import sys
import tempfile
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from swarmctl.cli import console

if TYPE_CHECKING:
    from swarmctl.cli.layers import Layers
    from swarmctl.spec.diagnostics import Diagnostic


class _Change(NamedTuple):
    """A file as it was read, and the text that it is to have, both without a byte order mark."""

    read: bytes
    file: str
    before: str
    after: str


def apply_fixes(specs: Iterable[Layers], *, quiet: bool) -> None:
    """Write the files of specs with every fix that can be applied, and say what was fixed."""
    from swarmctl.views.text import printable

    for spec in specs:
        made, changes = _fixed(spec)
        for change in changes:
            _write(change)
        for found in made if not quiet else ():
            title = found.fix.title if found.fix else ""
            console.err().print(printable(f"fixed {found.code} {found.span}: {title}"))


def show_diffs(specs: Iterable[Layers]) -> bool:
    """Print what ``--fix`` would change, and say whether there is something."""
    changes = [change for spec in specs for change in _fixed(spec)[1]]
    for _, file, before, after in changes:
        lines = (before.splitlines(keepends=True), after.splitlines(keepends=True))
        for line in difflib.unified_diff(*lines, file, file):
            sys.stdout.write(line if line.endswith("\n") else f"{line}\n\\ No newline at end of file\n")
    return bool(changes)


def _fixed(spec: Layers) -> tuple[tuple[Diagnostic, ...], list[_Change]]:
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
    changes = [_Change(read(Path(file)), file, original(file), text) for file, text in found.texts.items()]
    return found.made, changes


def _write(change: _Change) -> None:
    """Replace a file at once. It keeps its byte order mark, its mode and owner; links to it stay links."""
    path = Path(change.file).resolve()
    if not os.access(path, os.W_OK) or path.read_bytes() != change.read:
        why = "it is read-only" if not os.access(path, os.W_OK) else "it has just been changed"
        console.fail(f"{change.file} is left as it is: {why}")
    mark = codecs.BOM_UTF8 if change.read.startswith(codecs.BOM_UTF8) else b""
    try:
        _replace(path, mark + change.after.encode())
    except OSError as error:
        console.fail(f"cannot write {change.file}: {error.strerror or error}")


def _replace(path: Path, content: bytes) -> None:
    owned = path.stat()
    descriptor, draft = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        shutil.copymode(path, draft)
        if (owned.st_uid, owned.st_gid) != (os.geteuid(), os.getegid()):
            os.chown(draft, owned.st_uid, owned.st_gid)
        Path(draft).replace(path)
    except BaseException:
        Path(draft).unlink(missing_ok=True)
        raise
