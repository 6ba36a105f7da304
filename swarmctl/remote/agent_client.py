"""Runs the agent on a host and sends it requests: one process, one channel, request after request.

The host keeps the agent under its digest; it is sent only when the host reports that it has no such agent.
"""

from __future__ import annotations

import base64
import gzip
import io
import json
import secrets
import tarfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from functools import lru_cache
from typing import Any

from swarm_onboard.agent.manifest import NAME as MANIFEST

from swarmctl.remote.agent_archive import DEPLOY_VERBS, Agent, agent
from swarmctl.remote.answer_check import parsed, printable
from swarmctl.remote.transport import (
    CHANNEL_TIMEOUT,
    AgentSession,
    Channel,
    ChannelSession,
    HostError,
    Kind,
    Output,
    Session,
    SudoSession,
    WorkerSession,
)
from swarmctl.resources import HostModule, onboard

CHANGE_TIMEOUT = 300.0  # s for a change of the host; above the sum of the agent's own steps
_PACKED = b"z:"
_SIGNALLED = 128  # what a shell adds to the number of the signal that ended a command
_LONGEST_QUOTE = 300  # characters of what a host prints instead of an answer
_OTHER_COMMAND = (
    "look at the login shell of the account (`usermod -s /bin/bash ACCOUNT` on the host gives it another), "
    "and for a forced command (`command=` in authorized_keys, ForceCommand in sshd_config)"
)
_LONGEST_ANSWER = 8 << 20  # unpacked; an answer with the contents of a release is the longest

# -I and -S start Python faster, and without anything a user may have put in its way.
_RUN = 'python3 -I -S -c "$2" "$1" "$3" "$4"'
_BECOME = f'[ "$(id -u)" = 0 ] || exec sudo -n {_RUN}; '
# The first line checks the password, so that a wrong one ends the command instead of waiting for another;
# the second is for the agent's sudo. -k: what sudo remembers would leave that line to the agent.
_BECOME_WITH_PASSWORD = (
    'if [ "$(id -u)" = 0 ] || sudo -n true 2>/dev/null; then echo; echo "@$1 no-password"; '
    'else echo; echo "@$1 need-password"; IFS= read -r p; '
    'printf "%s\\n" "$p" | sudo -k -S -p "" true || { echo "@$1 wrong-password"; exit; }; '
    f'unset p; exec sudo -k -S -p "" {_RUN}; fi; {_BECOME}'
)
# A rule for sudo may allow no more than what starts the agent.
_TRUE = '[ "$(id -u)" = 0 ] || sudo -n true 2>/dev/null || exec sudo -n python3 -I -S -c ""'
_TRUE_WITH_PASSWORD = '[ "$(id -u)" = 0 ] || sudo -n true 2>/dev/null || exec sudo -S -p "" true'
_NEEDS = 'command -v python3 >/dev/null 2>&1 || { echo; echo "@$1 no-python"; exit; }; '


def pack(manifest: bytes, files: Mapping[str, tuple[bytes, int]]) -> bytes:
    """Returns the payload of ``apply``: manifest and files (content, mode) as a tar.gz.

    Same files, same bytes.
    """
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


def new_txid() -> str:
    """Returns a fresh name for a transaction."""
    return secrets.token_hex(8)


@contextmanager
def agent_session(
    session: Session,
    *,
    become: bool = True,
    verbs: tuple[str, ...] = DEPLOY_VERBS,
    module: HostModule | None = None,
) -> Iterator[AgentSession]:
    """A session with the host's agent, which starts with the first request and ends with the block.

    ``become`` runs the agent as root, through ``sudo`` if need be; ``module``: one that a verb runs.
    """
    with session_with(agent(verbs, module), session, become=become) as found:
        yield found


@contextmanager
def session_with(chosen: Agent, session: Session, *, become: bool) -> Iterator[AgentSession]:
    """As ``agent_session``, with this agent."""
    if isinstance(session, WorkerSession):
        yield session.agent_session(chosen, become=become)
        return
    with ExitStack() as channels:
        yield DirectAgentSession(session, chosen, become=become, channels=channels)


def become_root(session: Session) -> None:
    """Runs a command as root over the connection, as the agent runs. Raises ``HostError`` if that fails."""
    if isinstance(session, WorkerSession):
        session.become_root()
        return
    password = session.sudo_password() if isinstance(session, SudoSession) else None
    script = _TRUE if password is None else _TRUE_WITH_PASSWORD
    with session.channel(f"exec /bin/sh -c '{script}'") as channel:
        done = channel.exchange([password] if password else [], lambda _: False, timeout=CHANNEL_TIMEOUT)
    if done.status != 0:
        complaint = printable(done.stderr.strip().splitlines()[-1] if done.stderr.strip() else b"")
        if b"sudo:" in done.stderr:
            raise _no_sudo(done, complaint)
        raise HostError(
            Kind.PRIVILEGE,
            f"the host runs no command of this account as root (status {done.status}) {complaint}".rstrip(),
            "look at the login shell of the account, and at its rule for sudo",
        )


class DirectAgentSession:
    """An agent session over a connection of this process: one process on the host and one channel."""

    def __init__(self, session: ChannelSession, chosen: Agent, *, become: bool, channels: ExitStack) -> None:
        self._session = session
        self._agent = chosen
        self._become = become
        self._channels = channels
        self._open: tuple[Channel, _Answers] | None = None

    def request(
        self,
        request: Mapping[str, Any],
        payload: bytes = b"",
        *,
        on_note: Callable[[str], None] | None = None,
        timeout: float = 60.0,
    ) -> Any:
        """See ``AgentSession.request``."""
        line = json.dumps({**request, "payload": len(payload)}, separators=(",", ":")).encode() + b"\n"
        channel, answers, first = (*self._open, []) if self._open else self._start(0, timeout)
        done = channel.exchange([*first, line, payload], answers.parser(on_note), timeout=timeout)
        if answers.word == "need-agent":
            archive = self._agent.archive
            self._channels.close()  # sshd may allow one session a connection (MaxSessions)
            channel, answers, first = self._start(len(archive), timeout)
            stdin = [*first, archive, line, payload]
            done = channel.exchange(stdin, answers.parser(on_note), timeout=timeout)
        if answers.word == "wrong-password" and isinstance(self._session, SudoSession):
            self._session.sudo_rejected()
        return answers.result(done)

    def _start(self, size: int, timeout: float) -> tuple[Channel, _Answers, list[bytes]]:
        """Start the agent that the host keeps, or one of ``size`` bytes that comes first.

        Returned, too: what its ``sudo`` reads before everything else.
        """
        nonce = secrets.token_hex(8)
        session = self._session
        password = session.sudo_password() if self._become and isinstance(session, SudoSession) else None
        line = command(nonce, self._agent.digest, size, become=self._become, password=password is not None)
        channel = self._channels.enter_context(session.channel(line, limit=_LONGEST_ANSWER))
        answers = _Answers(nonce)
        self._open = channel, answers
        if password is None:
            return channel, answers, []
        done = channel.exchange([], answers.word_comes, timeout=timeout)
        word, answers.word = answers.word, ""
        if word not in ("need-password", "no-password"):
            raise _no_answer(word, done)
        return channel, answers, [password, password] if word == "need-password" else []


def command(nonce: str, digest: str, size: int, *, become: bool = True, password: bool = False) -> str:
    """Returns the command line that starts the agent under any login shell.

    With ``password`` it first prints whether it needs one, and then reads two lines with it.
    """
    root = _BECOME_WITH_PASSWORD if password else _BECOME
    script = f"{_NEEDS}{root if become else ''}exec {_RUN}"
    return f"exec /bin/sh -c '{script}' sh {nonce} '{_loader()}' {digest} {size}"


@lru_cache
def _loader() -> str:
    """The loader as one line: csh ends a quoted word at a line's end."""
    lines = (onboard() / "agent/loader.py").read_text(encoding="utf-8").splitlines(keepends=True)
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

    def parser(self, on_note: Callable[[str], None] | None) -> Callable[[bytes], bool]:
        """A function that takes each received piece and returns True once the answer is complete."""
        self._on_note = on_note
        self._final = None
        return self._feed

    def _feed(self, piece: bytes) -> bool:
        *lines, self._rest = (self._rest + piece).split(b"\n")
        for line in lines:
            if line.startswith(self._mark):
                self._take(line[len(self._mark) :])
        return self._final is not None

    def word_comes(self, piece: bytes) -> bool:
        """Takes a received piece; True once the host has printed a word instead of an answer."""
        self._feed(piece)
        return bool(self.word)

    def _take(self, text: bytes) -> None:
        if not text.startswith((_PACKED, b"{")):
            self.word = printable(text)
            return
        value = _parse(text)
        if not isinstance(note := value.get("note"), str):
            self._final = value
        elif self._on_note is not None:
            self._on_note(printable(note.encode()))

    def result(self, done: Output) -> dict[str, Any]:
        """The received answer. Raises ``HostError`` if it is an error, or if none came."""
        if self._final is None:
            raise _no_answer(self.word, done)
        answer, error = self._final.get("answer"), self._final.get("error")
        if isinstance(error, dict):
            raise _reported(error)
        if not isinstance(answer, dict):
            raise HostError(Kind.PROTOCOL, "the agent answered with neither a result nor an error")
        return answer


def _parse(text: bytes) -> dict[str, Any]:
    """The JSON object in ``text``, unpacked if need be; an empty one if it is something else."""
    try:
        if text.startswith(_PACKED):
            unpacker = zlib.decompressobj()
            text = unpacker.decompress(base64.b64decode(text[len(_PACKED) :]), _LONGEST_ANSWER)
        value = parsed(text)
    except (ValueError, zlib.error):
        return {}
    return value if isinstance(value, dict) else {}


def _reported(error: Mapping[str, Any]) -> HostError:
    """The error that the agent reports: refused or failed; any other kind is a protocol error."""
    kinds = (Kind.REFUSED, Kind.FAILED)
    kind = next((kind for kind in kinds if kind.value == error.get("kind")), Kind.PROTOCOL)
    message, hint = (printable(str(error.get(part, "")).encode()) for part in ("message", "hint"))
    return HostError(kind, message, hint)


def _no_answer(word: str, done: Output) -> HostError:
    """The error for a host that sent no answer, with the cause where its output shows one."""
    complaint = printable(done.stderr.strip().splitlines()[-1] if done.stderr.strip() else b"")
    if word == "no-python":
        return HostError(Kind.PROTOCOL, "the host has no python3", "install it: `apt install python3`")
    if word == "need-agent":
        return HostError(Kind.PROTOCOL, "the agent was damaged on its way", "run the same command again")
    if word == "wrong-password":
        return HostError(
            Kind.PRIVILEGE,
            f"sudo on this host rejects the password: {complaint}",
            "correct the file that SWARMCTL_SUDO_PASSWORD_FILE names, or let this account use sudo",
        )
    if word.startswith("cannot-keep-agent"):
        reason = word.partition(" ")[2]
        return HostError(
            Kind.REFUSED, f"the agent cannot be stored: {reason}", "is the file system full, or read-only?"
        )
    if b"sudo:" in done.stderr:
        return _no_sudo(done, complaint)
    printed = printable(b" ".join(line for line in done.stdout.split(b"\n") if line.strip()))[:_LONGEST_QUOTE]
    detail = f": {complaint or printed}" if complaint or printed else ""
    # Killed, for want of memory for example, it may answer the same request the next time.
    killed = done.status is not None and (done.status < 0 or done.status > _SIGNALLED)
    kind = Kind.LOST if killed else Kind.PROTOCOL
    if not killed and not word and not done.stdout and not done.stderr:
        return HostError(
            kind,
            f"the login shell of the account ended with status {done.status} and printed nothing, "
            "as /bin/false does: probably it runs no commands",
            _OTHER_COMMAND,
        )
    hint = "" if complaint or not printed else _OTHER_COMMAND
    return HostError(kind, f"the agent ended without an answer (status {done.status}){detail}", hint)


def _no_sudo(done: Output, complaint: str) -> HostError:
    if b" tty " in done.stderr:
        return HostError(
            Kind.PRIVILEGE,
            f"no root on this host: {complaint}",
            "add a file to /etc/sudoers.d with the line `Defaults !requiretty`",
        )
    return HostError(
        Kind.PRIVILEGE,
        f"no root on this host: {complaint}",
        "log in as root, let this user run sudo without a password (NOPASSWD in /etc/sudoers.d), "
        "or give its password with SWARMCTL_SUDO_PASSWORD_FILE (docs/hosts.md)",
    )
