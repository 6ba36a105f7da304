"""Runs system programs; finds and kills processes of a lab."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from swarmctl.lab.errors import LabError

SEARCH_PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"

# The Debian package of each program.
PACKAGES = {
    "ip": "iproute2",
    "mmdebstrap": "mmdebstrap",
    "mount": "mount",
    "setpriv": "util-linux",
    "ssh": "openssh-client",
    "ssh-keygen": "openssh-client",
    "systemd-nspawn": "systemd-container",
    "unshare": "util-linux",
}


def environment() -> dict[str, str]:
    """Returns the environment for system programs: root's PATH, and messages in English."""
    return {**os.environ, "PATH": SEARCH_PATH, "LC_ALL": "C.UTF-8"}


def require(*programs: str) -> None:
    """Raises ``LabError`` unless we are root and all ``programs`` are installed."""
    if os.geteuid() != 0:
        raise LabError("a lab boots real hosts and needs root", "run the same command with sudo")
    missing = [program for program in programs if shutil.which(program, path=SEARCH_PATH) is None]
    if missing:
        packages = " ".join(sorted({PACKAGES[program] for program in missing}))
        raise LabError(f"{_listed(missing)} not found", f"apt-get install {packages}")


def _listed(names: Sequence[str]) -> str:
    return f"{names[0]} is" if len(names) == 1 else f"{', '.join(names)} are"


def run(argv: Sequence[str], stdin: str = "") -> str:
    """Runs a system program and returns its stdout. Raises ``LabError`` with its error output."""
    done = subprocess.run(argv, input=stdin, capture_output=True, text=True, env=environment(), check=False)
    if done.returncode != 0:
        output = (done.stderr or done.stdout).strip() or f"exit status {done.returncode}"
        raise LabError(f"`{' '.join(argv)}` failed: {output}")
    return done.stdout


def isolated(argv: Sequence[str]) -> tuple[str, ...]:
    """Returns a command that runs ``argv`` in its own process and mount namespaces.

    When it ends or is killed, the kernel kills every process it started and drops every mount it made.
    """
    return (
        *("unshare", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc", "--propagation", "slave"),
        *argv,
    )


def processes() -> Iterator[int]:
    """Yields the ids of all processes."""
    return (int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdecimal())


def with_arguments(*arguments: str) -> list[int]:
    """Returns the processes whose arguments include all of ``arguments``."""
    wanted = {os.fsencode(argument) for argument in arguments}
    return [pid for pid in processes() if wanted.issubset(_arguments(pid))]


def in_network_namespaces(namespaces: Iterable[Path]) -> list[int]:
    """Returns the processes in one of these network namespaces."""
    wanted = {identity for namespace in namespaces if (identity := _identity(namespace))}
    return [pid for pid in processes() if _identity(Path(f"/proc/{pid}/ns/net")) in wanted]


def kill(pids: Iterable[int], timeout: float = 10.0) -> None:
    """Kills ``pids``, except ourselves and our ancestors.

    Raises ``LabError`` if one survives ``timeout`` s.
    """
    targets = set(pids) - set(_ancestors())
    deadline = time.monotonic() + timeout
    for pid in targets:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    while targets := {pid for pid in targets if _alive(pid)}:
        if time.monotonic() > deadline:
            raise LabError(f"processes {sorted(targets)} survive SIGKILL")
        time.sleep(0.01)


def _arguments(pid: int) -> list[bytes]:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")
    except OSError:
        return []


def _identity(namespace: Path) -> tuple[int, int] | None:
    try:
        found = namespace.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def _ancestors() -> Iterator[int]:
    pid = os.getpid()
    while pid:
        yield pid
        pid = int(_status(pid).get("PPid", "0"))


def _alive(pid: int) -> bool:
    """Returns whether any thread of ``pid`` runs; its main thread may already be dead."""
    status = _status(pid)
    return status.get("State", "Z")[0] not in "ZX" or int(status.get("Threads", "0")) > 1


def _status(pid: int) -> Mapping[str, str]:
    try:
        text = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return {}
    return {key: value.strip() for key, _, value in (line.partition(":") for line in text.splitlines())}
