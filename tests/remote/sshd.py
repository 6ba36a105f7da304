"""A real sshd on loopback, with its own host key, its own users' keys and its own log."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from swarmctl.remote.transport import Output, Session, Target
from tests.ports import free_port
from tests.timing import PATIENCE

SSHD = "/usr/sbin/sshd"


def missing() -> str:
    """What this machine lacks for these tests; empty if nothing."""
    if os.geteuid() != 0:
        return "root (sshd must be able to log users in)"
    absent = [tool for tool in (SSHD, "ssh-keygen") if shutil.which(tool) is None]
    return f"{', '.join(absent)} (apt install openssh-server)" if absent else ""


def make_key(path: Path, kind: str = "ed25519", passphrase: str = "") -> str:
    """Make a key pair at ``path``; return its public half."""
    command = ["ssh-keygen", "-q", "-t", kind, "-N", passphrase, "-C", "test", "-f", str(path)]
    subprocess.run(command, check=True)
    return " ".join(path.with_name(f"{path.name}.pub").read_text().split()[:2])


def run(
    session: Session,
    command: str,
    stdin: Sequence[bytes] = (),
    *,
    limit: int = 1 << 20,
    timeout: float = PATIENCE,
    enough: Callable[[bytes], bool] = lambda _: False,
) -> Output:
    """Run ``command`` to its end, or until its output is ``enough``."""
    with session.channel(command, limit=limit) as channel:
        return channel.exchange(stdin, enough, timeout=timeout)


def run_until(session: Session, act: Callable[[], object]) -> Output:
    """Run a command that ends only with its connection, and ``act`` once it has begun."""

    def begun(piece: bytes) -> bool:
        act()
        return False

    return run(session, "echo begun; exec cat", enough=begun)


@dataclass(frozen=True)
class Sshd:
    """A running server."""

    folder: Path
    port: int
    keys: tuple[str, ...]
    identity: Path
    process: subprocess.Popen[bytes]

    def target(self, **changes: object) -> Target:
        values: dict[str, object] = {
            "host": "pi",
            "address": "127.0.0.1",
            "user": "root",
            "port": self.port,
            "keys": self.keys,
            "identities": (self.identity,),
        }
        return Target(**{**values, **changes})  # type: ignore[arg-type]

    def end_connections(self) -> None:
        """Kill the processes of its connections; it takes new ones."""
        for child in self.children():
            with suppress(ProcessLookupError):
                os.kill(child, signal.SIGKILL)

    @property
    def log(self) -> str:
        return (self.folder / "log").read_text(errors="replace")

    def children(self) -> list[int]:
        listed = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text()
        return [int(word) for word in listed.split()]


@contextmanager
def running(
    folder: Path,
    *,
    kinds: tuple[str, ...] = ("ed25519",),
    authorize: bool = True,
    extra: str = "",
    within: Sequence[str] = (),
) -> Iterator[Sshd]:
    """Start an sshd in ``folder``; it and every connection of it are gone afterwards.

    ``within``: the command that executes the one after it, in namespaces for example.
    """
    folder.mkdir(parents=True, exist_ok=True)
    Path("/run/sshd").mkdir(exist_ok=True)
    keys = tuple(make_key(folder / f"host_{kind}", kind) for kind in kinds)
    identity = folder / "id"
    public = make_key(identity)
    (folder / "authorized").write_text(public + "\n" if authorize else "")
    port = free_port()
    config = [
        f"Port {port}",
        "ListenAddress 127.0.0.1",
        *(f"HostKey {folder}/host_{kind}" for kind in kinds),
        f"AuthorizedKeysFile {folder}/authorized",
        f"PidFile {folder}/pid",
        "PasswordAuthentication yes",
        "KbdInteractiveAuthentication no",
        "PermitRootLogin yes",
        "StrictModes no",
        "UsePAM no",
        "LogLevel DEBUG2",
        extra,
        f"SetEnv HOME={folder}/home",  # unless `extra` sets it: no .bashrc of this account prints anything
    ]
    (folder / "config").write_text("\n".join(config) + "\n")
    process = subprocess.Popen(
        [*within, SSHD, "-D", "-f", str(folder / "config"), "-E", str(folder / "log")],
        stdin=subprocess.DEVNULL,
    )
    server = Sshd(folder, port, keys, identity, process)
    try:
        _wait_for(server)
        yield server
    finally:
        for child in server.children() if process.poll() is None else []:
            with suppress(ProcessLookupError):
                os.kill(child, signal.SIGCONT)
                os.kill(child, signal.SIGKILL)
        process.terminate()
        process.wait(PATIENCE)


def _wait_for(server: Sshd) -> None:
    end = time.monotonic() + PATIENCE
    while "Server listening" not in (server.log if (server.folder / "log").exists() else ""):
        if server.process.poll() is not None or time.monotonic() > end:
            raise RuntimeError(f"sshd did not start: {server.log}")
        time.sleep(0.01)
