"""Talking to the agent on a host: one command that answers question after question.

The host keeps the agent under its digest; it is sent only when the host says that it has it not.
"""

from __future__ import annotations

import base64
import getpass
import gzip
import io
import json
import os
import secrets
import socket
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from hashlib import sha256
from typing import Any

from swarmctl.remote.transport import Channel, HostError, Kind, Output, Session
from swarmctl.resources import templates

DEPLOY_VERBS = ("observe", "keep", "apply", "remove")
MANIFEST = "manifest.json"
_PACKAGE = "swarm_agent"
_PACKED = b"z:"
_LONGEST_ANSWER = 8 << 20  # unpacked; an answer with the contents of a release is the longest

# -I and -S start Python faster, and without anything a user may have put in its way.
_RUN = 'python3 -I -S -c "$2" "$1" "$3" "$4"'
_BECOME = f'[ "$(id -u)" = 0 ] || exec sudo -n {_RUN}; '
_NEEDS = 'command -v python3 >/dev/null 2>&1 || { echo; echo "@$1 no-python"; exit; }; '


@dataclass(frozen=True)
class Agent:
    """The agent with some of its verbs, as the archive that a host keeps."""

    archive: bytes = field(repr=False)
    digest: str


@lru_cache
def agent(verbs: tuple[str, ...] = DEPLOY_VERBS) -> Agent:
    """The agent that knows ``verbs``. Same sources, same bytes."""
    root = templates() / "agent" / _PACKAGE
    shared = sorted(root.glob("*.py"))
    chosen = [root / "verbs" / f"{name}.py" for name in ("__init__", *verbs)]
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for path in [*shared, *chosen]:
            entry = zipfile.ZipInfo(f"{_PACKAGE}/{path.relative_to(root).as_posix()}")
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, path.read_bytes())
    content = stream.getvalue()
    return Agent(content, sha256(content).hexdigest())


def pack(manifest: bytes, files: Mapping[str, tuple[bytes, int]]) -> bytes:
    """The payload of ``apply``: manifest and files (content, mode) as a tar.gz. Same files, same bytes."""
    stream = io.BytesIO()
    with (
        gzip.GzipFile(fileobj=stream, mode="wb", compresslevel=6, mtime=0) as packed,
        tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as archive,
    ):
        for path, (content, mode) in [(MANIFEST, (manifest, 0o644)), *sorted(files.items())]:
            member = tarfile.TarInfo(path)
            member.size = len(content)
            member.mode = mode
            archive.addfile(member, io.BytesIO(content))
    return stream.getvalue()


def operator() -> str:
    """Who asks, for those who find the host locked."""
    return f"{getpass.getuser()}@{socket.gethostname()} ({os.getpid()})"


def new_txid() -> str:
    """A fresh name for a transaction."""
    return secrets.token_hex(8)


@contextmanager
def talk(
    session: Session, *, become: bool = True, verbs: tuple[str, ...] = DEPLOY_VERBS
) -> Iterator[Conversation]:
    """A conversation with the host's agent, which starts with the first question and ends with the block.

    ``become`` runs the agent as root, through ``sudo -n`` if need be.
    """
    with ExitStack() as channels:
        yield Conversation(session, agent(verbs), become=become, channels=channels)


class Conversation:
    """One agent at work on a host: one process and one channel for all questions."""

    def __init__(self, session: Session, chosen: Agent, *, become: bool, channels: ExitStack) -> None:
        self._session = session
        self._agent = chosen
        self._become = become
        self._channels = channels
        self._open: tuple[Channel, _Answers] | None = None

    def ask(
        self,
        request: Mapping[str, Any],
        payload: bytes = b"",
        *,
        on_note: Callable[[str], None] | None = None,
        timeout: float = 60.0,
    ) -> dict[str, Any]:
        """The agent's answer to ``request["verb"]``, within ``timeout`` seconds, or ``HostError``.

        After an error that the agent answered with (refused, failed, unknown verb) the next question may
        follow; after any other the agent is gone, and every further question says so.
        """
        line = json.dumps({**request, "payload": len(payload)}, separators=(",", ":")).encode() + b"\n"
        channel, answers = self._open or self._start(size=0)
        done = channel.exchange([line, payload], answers.hear(on_note), timeout=timeout)
        if answers.word == "need-agent":
            archive = self._agent.archive
            channel, answers = self._start(size=len(archive))
            done = channel.exchange([archive, line, payload], answers.hear(on_note), timeout=timeout)
        return answers.result(done)

    def _start(self, size: int) -> tuple[Channel, _Answers]:
        """Start the agent that the host keeps, or one of ``size`` bytes that comes first."""
        nonce = secrets.token_hex(8)
        line = command(nonce, self._agent.digest, size, become=self._become)
        channel = self._channels.enter_context(self._session.channel(line, limit=_LONGEST_ANSWER))
        self._open = channel, _Answers(nonce)
        return self._open


def command(nonce: str, digest: str, size: int, *, become: bool = True) -> str:
    """The command line that starts the agent under any login shell."""
    script = f"{_NEEDS}{_BECOME if become else ''}exec {_RUN}"
    return f"exec /bin/sh -c '{script}' sh {nonce} '{_loader()}' {digest} {size}"


@lru_cache
def _loader() -> str:
    """The loader as one line: csh ends a quoted word at a line's end."""
    lines = (templates() / "agent" / "loader.py").read_text(encoding="utf-8").splitlines(keepends=True)
    source = "".join(line for line in lines if not line.startswith("#"))
    return f"exec({json.dumps(source)})"


class _Answers:
    """Picks the marked lines out of what a host prints."""

    def __init__(self, nonce: str) -> None:
        self._mark = f"@{nonce} ".encode()
        self._rest = b""
        self._on_note: Callable[[str], None] | None = None
        self._final: dict[str, Any] | None = None
        self.word = ""

    def hear(self, on_note: Callable[[str], None] | None) -> Callable[[bytes], bool]:
        """What to give the pieces to that follow a question; says whether they made up its answer."""
        self._on_note = on_note
        self._final = None
        return self._feed

    def _feed(self, piece: bytes) -> bool:
        *lines, self._rest = (self._rest + piece).split(b"\n")
        for line in lines:
            if line.startswith(self._mark):
                self._take(line[len(self._mark) :])
        return self._final is not None

    def _take(self, text: bytes) -> None:
        value = _parse(text)
        if value is None:
            self.word = printable(text)
        elif not isinstance(note := value.get("note"), str):
            self._final = value
        elif self._on_note is not None:
            self._on_note(printable(note.encode()))

    def result(self, done: Output) -> dict[str, Any]:
        """The answer that was heard, or the error that it was."""
        if self._final is None:
            raise _silence(self.word, done)
        answer, error = self._final.get("answer"), self._final.get("error")
        if isinstance(error, dict):
            raise _reported(error)
        if not isinstance(answer, dict):
            raise HostError(Kind.PROTOCOL, "the agent answered with neither a result nor an error")
        return answer


def _parse(text: bytes) -> dict[str, Any] | None:
    """The JSON object in ``text``, unpacked if need be; None if it is something else."""
    try:
        if text.startswith(_PACKED):
            unpacker = zlib.decompressobj()
            text = unpacker.decompress(base64.b64decode(text[len(_PACKED) :]), _LONGEST_ANSWER)
        value = json.loads(text)
    except (ValueError, zlib.error):
        return None
    return value if isinstance(value, dict) else None


def _reported(error: Mapping[str, Any]) -> HostError:
    """The error that the agent answered with."""
    kind = next((kind for kind in Kind if kind.value == error.get("kind")), Kind.PROTOCOL)
    message, hint = (printable(str(error.get(part, "")).encode()) for part in ("message", "hint"))
    return HostError(kind, message, hint)


def _silence(word: str, done: Output) -> HostError:
    """Why a host said nothing, as far as can be told."""
    complaint = printable(done.stderr.strip().splitlines()[-1] if done.stderr.strip() else b"")
    if word == "no-python":
        return HostError(Kind.PROTOCOL, "the host has no python3", "install it: `apt install python3`")
    if word == "need-agent":
        return HostError(Kind.PROTOCOL, "the agent was damaged on its way", "run the same command again")
    if word.startswith("cannot-keep-agent"):
        reason = word.partition(" ")[2]
        return HostError(
            Kind.REFUSED, f"the agent cannot be stored: {reason}", "is the file system full, or read-only?"
        )
    if b"sudo:" in done.stderr:
        return HostError(
            Kind.PRIVILEGE,
            f"no root on this host: {complaint}",
            "log in as root, or let this user run sudo without a password (NOPASSWD in /etc/sudoers.d)",
        )
    said = f": {complaint}" if complaint else ""
    return HostError(Kind.PROTOCOL, f"the agent ended without an answer (status {done.status}){said}")


def printable(text: bytes) -> str:
    """Text from a host, harmless on a terminal: whatever could steer it is written out as an escape."""
    return "".join(
        char if char.isprintable() else char.encode("unicode_escape").decode()
        for char in text.decode("utf-8", "backslashreplace")
    )
