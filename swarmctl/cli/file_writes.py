"""Changes to a user's files: shown as a diff, or written atomically with mode and owner kept."""

from __future__ import annotations

import codecs
import difflib
import os
import shutil
import tempfile
from collections.abc import Sequence
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


def write(changes: Sequence[Change]) -> None:
    """Replace files, all of them or none. Byte order mark, mode and owner stay; symbolic links stay links.

    Ends the program before anything is written if a file is read-only, or changed since it was read.
    """
    untouched = "; no file was changed" if len(changes) > 1 else ""
    by_path: dict[Path, Change] = {}
    for change in changes:
        path = Path(change.file).resolve()
        same = by_path.setdefault(path, change)
        why = "it is read-only" if not os.access(path, os.W_OK) else ""
        why = why or ("it changed meanwhile" if path.read_bytes() != change.read else "")
        why = why or (f"it is the same file as {same.file}" if same.after != change.after else "")
        if why:
            console.fail(f"{change.file} was not written: {why}{untouched}")
    drafts: dict[Path, Path] = {}
    done: list[Path] = []
    path = Path()
    try:
        for path, change in by_path.items():
            mark = codecs.BOM_UTF8 if change.read.startswith(codecs.BOM_UTF8) else b""
            drafts[path] = _draft(path, mark + change.after.encode(errors="surrogateescape"))
        for path, draft in drafts.items():
            draft.replace(path)
            done.append(path)
    except BaseException as error:
        for one in done:
            _replace(one, by_path[one].read)
        if not isinstance(error, OSError):
            raise
        console.fail(f"cannot write {by_path[path].file}: {error.strerror or error}{untouched}")
    finally:
        for draft in drafts.values():
            draft.unlink(missing_ok=True)


def replace(path: Path, content: bytes, mode: int = 0o644) -> None:
    """Write a file atomically: a reader, or a crash, finds the old or the new content, never a part.

    Mode and owner of an old file stay, symbolic links stay links. Ends the program if it cannot be written.
    """
    try:
        _replace(path.resolve(), content, mode)
    except OSError as error:
        console.fail(f"cannot write {path}: {error.strerror or error}")


def create(path: Path, content: bytes) -> None:
    """Write a new file and the folders above it; a failure leaves nothing of the file. Raises ``OSError``."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("xb") as file:
        try:
            file.write(content)
            file.flush()
        except BaseException:
            path.unlink()
            raise


def _replace(path: Path, content: bytes, mode: int = 0o644) -> None:
    _draft(path, content, mode).replace(path)


def _draft(path: Path, content: bytes, mode: int = 0o644) -> Path:
    """Returns a file beside ``path`` with ``content``, its owner and its mode; a new one has ``mode``."""
    descriptor, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    draft = Path(name)
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
            draft.chmod(mode)
    except BaseException:
        draft.unlink(missing_ok=True)
        raise
    return draft
