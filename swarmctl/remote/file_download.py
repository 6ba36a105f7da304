"""Moves a file from a host to here: goes on where a transfer broke off, and checks the whole (SHA-256)."""

from __future__ import annotations

import hashlib
import os
import re
import shlex
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from swarmctl.remote.transport import ChannelSession, HostError, Kind

_CHECKED_WITHIN = 900.0  # s in which a host reads a file for its checksum
_SHA256 = re.compile(rb"\\?([0-9a-f]{64}) .*\n(\d+)\n", re.DOTALL)
_PIECE = 1 << 20


def move(session: ChannelSession, path: str, place: Path, received: Callable[[int], None]) -> None:
    """Writes the file ``path`` of the host to ``place``, and removes it from the host.

    What has come is kept beside ``place`` until all has, and the next call goes on there. ``received`` gets
    how many bytes are here. A file at ``place`` that is the same stays. Raises ``HostError``.
    """
    digest, size = _digest_and_size(session, path)
    part = place.with_name(f".{place.name}.{digest[:12]}.part")
    with _writing(place):
        if place.exists():
            if _digest_here(place) != digest:
                raise HostError(
                    Kind.FAILED,
                    f"{place} exists, and is not that of the host",
                    "move it away, then fetch again",
                )
        else:
            _download(session, path, part, received)
            if part.stat().st_size < size:
                raise HostError(Kind.LOST, f"{path} came in part")
            if _digest_here(part) != digest:
                part.unlink()
                raise HostError(Kind.LOST, f"{path} was damaged on its way", "fetch it again")
            part.rename(place)
    _run(session, f"rm -- {shlex.quote(path)}")


def _digest_and_size(session: ChannelSession, path: str) -> tuple[str, int]:
    quoted = shlex.quote(path)
    found = _SHA256.fullmatch(_run(session, f"sha256sum -- {quoted} && stat -c %s -- {quoted}"))
    if found is None:
        raise HostError(Kind.PROTOCOL, "`sha256sum` printed no checksum", "is it the right host?")
    return found[1].decode(), int(found[2])


def _digest_here(place: Path) -> str:
    digest = hashlib.sha256()
    with place.open("rb") as file:
        while piece := file.read(_PIECE):
            digest.update(piece)
    return digest.hexdigest()


def _download(session: ChannelSession, path: str, part: Path, received: Callable[[int], None]) -> None:
    with part.open("ab") as file:
        here = os.fstat(file.fileno()).st_size
        line = f"tail -c +{here + 1} -- {shlex.quote(path)}"
        with session.channel(_portable(line), limit=1 << 30) as channel:
            status, complaint = None, b""
            while status is None:
                piece = channel.more()
                file.write(piece.stdout)
                complaint += piece.stderr
                here += len(piece.stdout)
                received(here)
                status = piece.status
        if status:
            raise _failed(line, status, complaint)
        file.flush()
        os.fsync(file.fileno())


def _run(session: ChannelSession, line: str) -> bytes:
    with session.channel(_portable(line)) as channel:
        done = channel.exchange([], lambda _: False, timeout=_CHECKED_WITHIN)
    if done.status:
        raise _failed(line, done.status, done.stderr)
    return done.stdout


def _portable(line: str) -> str:
    """``line`` for any login shell."""
    return f"exec /bin/sh -c {shlex.quote(line)}"


def _failed(line: str, status: int, complaint: bytes) -> HostError:
    text = complaint.decode("utf-8", "replace").strip().rpartition("\n")[2]
    return HostError(Kind.FAILED, f"`{line}` failed: {text or f'exit code {status}'}"[:300])


@contextmanager
def _writing(place: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise HostError(Kind.FAILED, f"{place} cannot be written: {error.strerror}") from error
