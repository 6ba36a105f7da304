"""Starting a lab's supervisor so that it outlives us, in a place of the machine where it may make cgroups."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from swarmctl.lab import control, processes
from swarmctl.lab.errors import LabError
from swarmctl.lab.places import Home

SUPERVISOR = "swarmctl.lab.supervisor"
SYSTEMD_RUNS = Path("/run/systemd/system")
INOTIFY = Path("/proc/sys/fs/inotify/max_user_instances")
INOTIFY_ENOUGH = 8192  # a booted host takes several; the usual 128 are gone after 20 hosts
PATIENCE = 90.0
BIRTH_PATIENCE = 1.0


def allow_inotify(say: Callable[[str], None]) -> None:
    allowed = int(INOTIFY.read_text())
    if allowed < INOTIFY_ENOUGH:
        INOTIFY.write_text(str(INOTIFY_ENOUGH))
        say(f"raised fs.inotify.max_user_instances from {allowed} to {INOTIFY_ENOUGH} for the hosts' systemd")


def launch(place: Home) -> None:
    """Start the supervisor, on its own from here on, and wait until it answers."""
    argv = processes.sealed((sys.executable, "-m", SUPERVISOR, str(place.directory)))
    end(place)
    place.socket.unlink(missing_ok=True)
    if SYSTEMD_RUNS.is_dir():
        processes.run(service_argv(place, argv))
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
    while asked(place) is None:
        waited = time.monotonic() - began
        # A process shows no arguments in the moment in which it is started.
        gone = waited > BIRTH_PATIENCE and not running(place)
        if gone or waited > PATIENCE:
            raise LabError("the lab's supervisor did not start", *last_lines(place.log))
        time.sleep(0.02)


def end(place: Home) -> None:
    """End the supervisor, whatever state it is in, and with it every process and mount of the lab."""
    processes.kill(running(place))
    if SYSTEMD_RUNS.is_dir():  # waits until systemd has let go of the unit, so that its name is free again
        stop = ("systemctl", "stop", service(place))
        subprocess.run(stop, capture_output=True, env=processes.environment(), check=False)


def service(place: Home) -> str:
    return f"{place.tag.replace('@', '-')}.service"


def service_argv(place: Home, argv: Sequence[str]) -> tuple[str, ...]:
    """``argv`` as a transient service of the machine's systemd, which hands it a cgroup of its own.

    When the machine goes down, the lab loses its power: the first process of a PID namespace, the supervisor,
    hears no SIGTERM, and waiting for it would be in vain.
    """
    return (
        *("systemd-run", "--quiet", "--collect", f"--unit={service(place)}"),
        *("--property=Delegate=yes", "--property=TasksMax=infinity", "--property=LimitNOFILE=65536"),
        *("--property=KillSignal=SIGKILL", f"--description=swarmctl lab {place.name}"),
        *argv,
    )


def running(place: Home) -> list[int]:
    """The supervisor's processes, whether they answer or not."""
    return processes.with_arguments(SUPERVISOR, str(place.directory))


def asked(place: Home) -> dict[str, Any] | None:
    """What the supervisor says, or nothing when there is none."""
    try:
        return control.ask(place.socket, {"do": "status"})
    except OSError:
        return None


def last_lines(log: Path) -> list[str]:
    return log.read_text(errors="replace").splitlines()[-5:] if log.exists() else []
