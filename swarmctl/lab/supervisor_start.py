"""Starts and stops the supervisor of a lab: a process that outlives the command, with cgroups of its own."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from swarmctl.lab import supervisor_client
from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import processes
from swarmctl.lab.paths import LabPaths, last_lines

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
    while supervisor_client.status(files) is None:
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
