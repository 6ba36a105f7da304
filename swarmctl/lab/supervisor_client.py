"""The supervisor of a lab from outside: its start and end, and the requests to it."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import processes
from swarmctl.lab.lab_state import read_state
from swarmctl.lab.paths import LabPaths, last_lines

Handler = Callable[[Mapping[str, str]], Mapping[str, Any]]


def send(path: Path, request: Mapping[str, str], timeout: float = 10.0) -> dict[str, Any]:
    """Sends a request and returns the answer.

    Raises ``LabError`` if it is refused, ``OSError`` if nobody answers.
    """
    with socket.socket(socket.AF_UNIX) as connection, _short_path(path) as address:
        connection.settimeout(timeout)
        connection.connect(address)
        with connection.makefile("rwb") as stream:
            stream.write(_line(request))
            stream.flush()
            line = stream.readline()
    if not line:
        raise ConnectionResetError(f"{path} closed without an answer")
    answer: dict[str, Any] = json.loads(line)
    if "error" in answer:
        raise LabError(answer["error"], *answer.get("help", ()))
    return answer


def listen(path: Path) -> socket.socket:
    """Returns a listening socket at ``path`` that only root can open."""
    path.unlink(missing_ok=True)
    server = socket.socket(socket.AF_UNIX)
    with _short_path(path) as address:
        server.bind(address)
    path.chmod(0o600)
    server.listen()
    return server


def serve(server: socket.socket, handler: Handler) -> None:
    """Answers requests one by one and never returns.

    A client that disconnects or stalls is dropped after 5 s.
    """
    while True:
        connection, _ = server.accept()
        with connection, suppress(OSError, ValueError):
            connection.settimeout(5.0)
            with connection.makefile("rwb") as stream:
                stream.write(_line(_handled(_request(stream.readline(1 << 16)), handler)))


def _request(line: bytes) -> Mapping[str, str]:
    """Parses a request. Raises ``ValueError`` for anything but one flat object of strings."""
    request = json.loads(line)
    if not isinstance(request, dict) or not all(isinstance(value, str) for value in request.values()):
        raise ValueError("not a request")
    return request


def _handled(request: Mapping[str, str], handler: Handler) -> Mapping[str, Any]:
    try:
        return handler(request)
    except LabError as error:
        return {"error": str(error), "help": error.help_lines}
    except OSError as error:
        return {"error": f"the lab's supervisor failed: {error}"}


def _line(message: Mapping[str, Any]) -> bytes:
    return json.dumps(message).encode() + b"\n"


@contextmanager
def _short_path(path: Path) -> Iterator[str]:
    """Yields a name for ``path`` that fits a socket address (108 bytes)."""
    folder = os.open(path.parent, os.O_PATH | os.O_DIRECTORY)
    try:
        yield f"/proc/self/fd/{folder}/{path.name}"
    finally:
        os.close(folder)


def status(files: LabPaths) -> dict[str, Any] | None:
    """Returns the supervisor's report on hosts and robots; None if it does not run."""
    try:
        return send(files.socket, {"do": "status"})
    except OSError:
        return None


def running(files: LabPaths) -> dict[str, Any]:
    """Returns the report of a running lab. Raises ``LabError`` if it is not up or not running."""
    read_state(files)
    report = status(files)
    if report is None:
        raise _not_running(files)
    return report


def command(files: LabPaths, verb: str, subject: str) -> None:
    """Sends ``verb`` for a host or a robot. Raises ``LabError`` if it fails or the lab is not running."""
    try:
        send(files.socket, {"do": verb, "what": subject})
    except OSError:
        raise _not_running(files) from None


def _not_running(files: LabPaths) -> LabError:
    return LabError(
        f"lab {files.name} is not running",
        "run `swarmctl lab up` to start it again, `lab down` to remove it",
    )


SUPERVISOR = "swarmctl.lab.supervisor"
SYSTEMD_RUNS = Path("/run/systemd/system")
INOTIFY = Path("/proc/sys/fs/inotify/max_user_instances")
INOTIFY_NEEDED = 8192  # each booted host needs several; the default of 128 lasts for 20 hosts
START_TIMEOUT = 90.0  # s
EXEC_TIME = 1.0  # s until a started process shows its arguments


def allow_inotify(progress: Callable[[str], None]) -> None:
    """Raises the kernel's limit of inotify instances to what the hosts' systemd needs."""
    allowed = int(INOTIFY.read_text())
    if allowed < INOTIFY_NEEDED:
        INOTIFY.write_text(str(INOTIFY_NEEDED))
        progress(f"raised fs.inotify.max_user_instances from {allowed} to {INOTIFY_NEEDED}")


def launch(files: LabPaths) -> None:
    """Starts the supervisor in the background and waits until it answers.

    Raises ``LabError`` if it does not.
    """
    argv = processes.isolated((sys.executable, "-m", SUPERVISOR, str(files.directory)))
    stop(files)
    files.socket.unlink(missing_ok=True)
    if SYSTEMD_RUNS.is_dir():
        processes.run(service_argv(files, argv))
    else:
        subprocess.Popen(
            argv,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
            cwd="/",
            env=processes.environment(),
        )
    began = time.monotonic()
    while status(files) is None:
        waited = time.monotonic() - began
        gone = waited > EXEC_TIME and not pids(files)
        if gone or waited > START_TIMEOUT:
            raise LabError("the lab's supervisor did not start", *last_lines(files.log))
        time.sleep(0.02)


def stop(files: LabPaths) -> None:
    """Kills the supervisor and, with it, every process and mount of the lab."""
    processes.kill(pids(files))
    if SYSTEMD_RUNS.is_dir():  # returns when the unit's name is free again
        command = ("systemctl", "stop", service(files))
        subprocess.run(command, capture_output=True, env=processes.environment(), check=False)


def service(files: LabPaths) -> str:
    """Returns the name of the lab's systemd service."""
    return f"{files.tag.replace('@', '-')}.service"


def service_argv(files: LabPaths, argv: Sequence[str]) -> tuple[str, ...]:
    """Returns ``argv`` as a transient systemd service with a delegated cgroup.

    It is stopped with SIGKILL: the supervisor is the first process of a PID namespace and ignores SIGTERM.
    """
    return (
        *("systemd-run", "--quiet", "--collect", f"--unit={service(files)}"),
        *("--property=Delegate=yes", "--property=TasksMax=infinity", "--property=LimitNOFILE=65536"),
        *("--property=KillSignal=SIGKILL", f"--description=swarmctl lab {files.name}"),
        *argv,
    )


def pids(files: LabPaths) -> list[int]:
    """Returns the supervisor's process ids, whether it answers or not."""
    return processes.with_arguments(SUPERVISOR, str(files.directory))
