"""Changes to a user's file: shown as a diff, or written atomically with mode and owner kept."""

from __future__ import annotations

import codecs
import difflib
import os
import shutil
import tempfile
from pathlib import Path
from typing import NamedTuple

from swarmctl.cli import console


class Change(NamedTuple):
    """A file as it was read, and its texts before and after the change, without byte order mark."""

    read: bytes
    file: str
    before: str
    after: str


def difference(change: Change) -> str:
    """The change as a unified diff."""
    texts = (change.before.splitlines(keepends=True), change.after.splitlines(keepends=True))
    lines = difflib.unified_diff(*texts, change.file, change.file)
    return "".join(
        line if line.endswith("\n") else f"{line}\n\\ No newline at end of file\n" for line in lines
    )


def write(change: Change) -> None:
    """Replace a file atomically. Byte order mark, mode and owner stay; symbolic links stay links."""
    path = Path(change.file).resolve()
    if not os.access(path, os.W_OK) or path.read_bytes() != change.read:
        why = "it is read-only" if not os.access(path, os.W_OK) else "it changed meanwhile"
        console.fail(f"{change.file} was not written: {why}")
    mark = codecs.BOM_UTF8 if change.read.startswith(codecs.BOM_UTF8) else b""
    replace(Path(change.file), mark + change.after.encode())


def replace(path: Path, content: bytes) -> None:
    """Write a file atomically: a reader, or a crash, finds the old or the new content, never a part.

    Mode and owner of an old file stay, symbolic links stay links. Ends the program if it cannot be written.
    """
    try:
        _replace(path.resolve(), content)
    except OSError as error:
        console.fail(f"cannot write {path}: {error.strerror or error}")


def _replace(path: Path, content: bytes) -> None:
    descriptor, draft = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        if path.exists():
            owned = path.stat()
            shutil.copymode(path, draft)
            if (owned.st_uid, owned.st_gid) != (os.geteuid(), os.getegid()):
                os.chown(draft, owned.st_uid, owned.st_gid)
        else:
            Path(draft).chmod(0o644)
        Path(draft).replace(path)
    except BaseException:
        Path(draft).unlink(missing_ok=True)
        raise
