"""The folder of a capsule: its files are hashed, its index is written and read, and both are compared."""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

from pydantic import ValidationError

from swarmctl.capsule.capsule_index import INDEX, LONGEST, SIGNATURE, CapsuleError, File, Index, problem_of
from swarmctl.remote.answer_check import printable

_DRAFT = f".{INDEX}.new"
_MOST_BYTES = 64 << 20  # of an index
_PIECE = 1 << 20  # bytes
_BROKEN = "it is damaged, or not a capsule; `swarmctl run` writes one for each trial"


def write(folder: Path, about: Mapping[str, Any]) -> Index:
    """Returns the index of a folder, once it is written there: ``about`` the trial, and all files below.

    Links and what is no regular file are left out. An older index and its signature are replaced. Texts that
    no terminal should print are escaped. Raises ``CapsuleError``.
    """
    try:
        (folder / _DRAFT).unlink(missing_ok=True)
        files = {path: _described(folder / path) for path, kind in sorted(_entries(folder)) if not kind}
        index = Index.model_validate({"v": 1, **_escaped(about), "files": files})
        (folder / SIGNATURE).unlink(missing_ok=True)
        _replace(folder, index.model_dump_json(indent=1).encode() + b"\n")
    except ValidationError as error:
        raise CapsuleError(
            f"no index for {_shown(folder)}: {problem_of(error)}", "rename the file, or correct the value"
        ) from None
    except OSError as error:
        raise _failed("write", error, folder / INDEX) from None
    return index


def read(folder: Path) -> Index:
    """Returns the index of a capsule. Raises ``CapsuleError``."""
    try:
        return Index.model_validate_json(index_bytes(folder))
    except ValidationError as error:
        raise CapsuleError(
            f"{_shown(folder / INDEX)} is not an index: {problem_of(error)}", _BROKEN
        ) from None


def index_bytes(folder: Path) -> bytes:
    """Returns the index as it is written. Raises ``CapsuleError``."""
    try:
        with _opened(folder / INDEX) as file:
            data = file.read(_MOST_BYTES + 1)
    except (FileNotFoundError, NotADirectoryError):
        raise CapsuleError(f"{_shown(folder)} is not a capsule: it has no {INDEX}", _BROKEN) from None
    except OSError as error:
        raise _failed("read", error, folder / INDEX) from None
    if len(data) > _MOST_BYTES:
        raise CapsuleError(f"{_shown(folder / INDEX)} has more than {_MOST_BYTES >> 20} MB", _BROKEN)
    return data


def problems(folder: Path) -> tuple[str, ...]:
    """Returns what differs from the index: files that are missing, changed or added, and links.

    Raises ``CapsuleError`` if there is no index to compare with.
    """
    wanted = read(folder).files
    try:
        there = dict(_entries(folder))
    except OSError as error:
        raise _failed("read", error, folder) from None
    found = {path: kind or _difference(folder / path, wanted.get(path)) for path, kind in there.items()}
    found |= dict.fromkeys(wanted.keys() - there.keys(), "is missing")
    return tuple(f"{_shown(path)} {problem}" for path, problem in sorted(found.items()) if problem)


def below(folder: Path, levels: int = 2) -> list[Path]:
    """Returns the capsules: the folder itself, or else those at most ``levels`` below it.

    Links are not followed; what cannot be read has none.
    """
    if os.path.lexists(folder / INDEX):
        return [folder]
    if not levels:
        return []
    try:
        inner = sorted(entry.name for entry in os.scandir(folder) if entry.is_dir(follow_symlinks=False))
    except OSError:
        return []
    return [one for name in inner for one in below(folder / name, levels - 1)]


def _difference(file: Path, wanted: File | None) -> str:
    if wanted is None:
        return "was added"
    try:
        if file.lstat().st_size == wanted.bytes and _described(file).sha256 == wanted.sha256:
            return ""
    except OSError as error:
        return f"cannot be read: {error.strerror}"
    return "has changed"


def _entries(folder: Path) -> Iterator[tuple[str, str]]:
    """Yields each file below a folder but the index and its signature: its path, and why it cannot be one."""
    above = [""]
    while above:
        inner = above.pop()
        with os.scandir(folder / inner) as entries:
            for entry in entries:
                path = f"{inner}{entry.name}"
                if entry.is_dir(follow_symlinks=False):
                    above.append(f"{path}/")
                elif entry.is_symlink():
                    yield path, "is a link"
                elif not entry.is_file(follow_symlinks=False):
                    yield path, "is not a file"
                elif path not in (INDEX, SIGNATURE):
                    yield path, ""


def _described(file: Path) -> File:
    digest, size = hashlib.sha256(), 0
    with _opened(file) as stream:
        executable = bool(os.fstat(stream.fileno()).st_mode & stat.S_IXUSR)
        while piece := stream.read(_PIECE):
            digest.update(piece)
            size += len(piece)
    return File(sha256=digest.hexdigest(), bytes=size, executable=executable)


def _opened(file: Path) -> BinaryIO:
    """A regular file that is no link, without waiting for a writer of a pipe. Raises ``OSError``."""
    stream = os.fdopen(os.open(file, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC), "rb")
    if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
        stream.close()
        raise OSError(0, "it is not a file")
    return stream


def _replace(folder: Path, content: bytes) -> None:
    draft = folder / _DRAFT
    try:
        with draft.open("xb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        draft.replace(folder / INDEX)
    finally:
        draft.unlink(missing_ok=True)


def _escaped(value: Any) -> Any:
    """The value, its texts printable and not too long."""
    if isinstance(value, str):
        return printable(value.encode(errors="backslashreplace"))[:LONGEST]
    if isinstance(value, Mapping):
        return {key: _escaped(one) for key, one in value.items()}
    return [_escaped(one) for one in value] if isinstance(value, list | tuple) else value


def _shown(path: str | Path) -> str:
    return printable(os.fsencode(path))


def _failed(what: str, error: OSError, place: Path) -> CapsuleError:
    message = f"cannot {what} {_shown(error.filename or place)}: {error.strerror or error}"
    return CapsuleError(message, "is the disk full, or the folder somebody else's?")
