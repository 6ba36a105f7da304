"""One shell command on many hosts: what each printed, its exit status, and its end with the connection."""

from __future__ import annotations

import codecs
import shlex
import threading
from collections.abc import Callable, Generator, Iterable, Sequence
from dataclasses import dataclass

from swarmctl.remote import parallel_hosts
from swarmctl.remote.parallel_hosts import Event, Finished, Note, Stop
from swarmctl.remote.transport import Channel, HostError, Kind, Session, Target, Transport, WorkerSession

MARK = "! "  # before a line of standard error
LIMIT = 1 << 20  # bytes of each stream that are kept of one host
_LONGEST_LINE = 1 << 14  # characters after which a line that is followed is printed without its end
_AHEAD = 1000  # lines that hosts may be ahead of who prints them

# Closing a session without a terminal ends nothing on the host: sshd closes the pipes of the command alone.
# So a watcher reads the standard input of the session and ends the process group, which sshd has made for it.
# Processes of root, by sudo, are not ours to end; password-free sudo, if that is how they came, ends them.
_SCRIPT = """\
exec 3<&0 </dev/null
(
  trap "" TERM
  read -r _ <&3
  kill -TERM 0
  sudo -n kill -TERM -- "-$$"
  sleep 5
  kill -KILL 0
) >/dev/null 2>&1 &
watcher=$!
"${SHELL:-/bin/sh}" -c "$1" 3<&-
status=$?
{ kill -KILL $watcher; exit $status; } 2>/dev/null
"""


@dataclass(frozen=True)
class Ran:
    """What a command printed on one host, and its exit status.

    With an ``error`` there is no status: the host was not reached, or the command was cut off after that.
    """

    host: str
    status: int | None
    stdout: bytes = b""
    stderr: bytes = b""
    error: HostError | None = None


def shell_command(words: Sequence[str]) -> str:
    """Returns the command line for the shell of a host: one word is a line, of several each is quoted."""
    return words[0] if len(words) == 1 else shlex.join(words)


def run(
    targets: Iterable[Target],
    command: str,
    transport: Transport,
    *,
    parallel: int,
    follow: bool = False,
    stop: Stop | None = None,
) -> Generator[Event[Ran], None, None]:
    """Run ``command`` on every target by the login shell of its account, without standard input or terminal.

    If ``follow``, each line is a ``Note`` as it comes, those of standard error after ``MARK``, and the
    results have no output; otherwise a host that prints more than ``LIMIT`` bytes on a stream gets an error.
    Who stops reading the events ends the command everywhere: by SIGTERM, 5 s later by SIGKILL. So does the
    second request of ``stop``.
    """
    ahead = threading.Semaphore(_AHEAD)
    line = f"exec /bin/sh -c {shlex.quote(_SCRIPT)} sh {shlex.quote(command)}"

    def work(session: Session, target: Target, note: Callable[[str], None]) -> Ran:
        assert not isinstance(session, WorkerSession)

        def say(text: str) -> None:
            ahead.acquire()  # a host that floods waits for the terminal
            note(text)

        with session.channel(line, limit=1 << 30) as channel:
            return _followed(channel, target.host, say) if follow else _collected(channel, target.host)

    for event in parallel_hosts.run(targets, work, transport=transport, parallel=parallel, stop=stop):
        yield event
        if isinstance(event, Note):
            ahead.release()


def ran(event: Finished[Ran]) -> Ran:
    """Returns the result of a host; without a connection it is an error alone."""
    result = event.outcome
    return Ran(event.host, None, error=result) if isinstance(result, HostError) else result


def _collected(channel: Channel, host: str) -> Ran:
    stdout, stderr = bytearray(), bytearray()
    try:
        status = None
        while status is None:
            piece = channel.more()
            stdout += piece.stdout
            stderr += piece.stderr
            if max(len(stdout), len(stderr)) > LIMIT:
                return Ran(host, None, error=_flood(host))
            status = piece.status
    except HostError as error:
        return Ran(host, None, bytes(stdout), bytes(stderr), error)
    return _ended(host, status, bytes(stdout), bytes(stderr))


def _followed(channel: Channel, host: str, say: Callable[[str], None]) -> Ran:
    stdout, stderr = _Lines(say), _Lines(lambda line: say(f"{MARK}{line}"))
    status = None
    try:
        while status is None:
            piece = channel.more()
            stdout.add(piece.stdout)
            stderr.add(piece.stderr)
            status = piece.status
    except HostError as error:
        return Ran(host, None, error=error)
    finally:
        stdout.end()
        stderr.end()
    return _ended(host, status)


def _ended(host: str, status: int, stdout: bytes = b"", stderr: bytes = b"") -> Ran:
    if status < 0:  # RFC 4254, 6.10: the session ended by a signal, which is the end of its shell
        error = HostError(Kind.FAILED, f"{host}: the shell of the command was killed")
        return Ran(host, None, stdout, stderr, error)
    return Ran(host, status, stdout, stderr)


def _flood(host: str) -> HostError:
    return HostError(
        Kind.FAILED,
        f"{host}: the command printed more than {LIMIT >> 20} MiB, and was ended",
        "--follow prints it as it comes, without a limit",
    )


class _Lines:
    """Cuts what a stream brings into lines."""

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say = say
        self._decode = codecs.getincrementaldecoder("utf-8")("replace").decode
        self._rest = ""

    def add(self, piece: bytes) -> None:
        *lines, self._rest = (self._rest + self._decode(piece)).split("\n")
        for line in lines:
            self._say(line.removesuffix("\r"))
        if len(self._rest) > _LONGEST_LINE:
            self._say(self._rest)
            self._rest = ""

    def end(self) -> None:
        if self._rest:
            self._say(self._rest)
