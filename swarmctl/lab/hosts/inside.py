"""Commands inside a running host, as root and without SSH: through the namespaces of its first process."""

from __future__ import annotations

import re
from pathlib import Path

from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import processes
from swarmctl.lab.hosts.network import namespace_path
from swarmctl.lab.paths import LabPaths


def argv(leader: int, script: str) -> tuple[str, ...]:
    """Returns the command that runs a shell script in the namespaces of the process ``leader``."""
    return (
        *("nsenter", f"--target={leader}", "--mount", "--uts", "--ipc", "--net", "--pid"),
        *("--root", "--wd", "--", "/bin/sh", "-c", script),
    )


def argv_as_operator(files: LabPaths, script: str) -> tuple[str, ...]:
    """Returns the command that runs a shell script on this machine, in the operator's network of the lab."""
    return ("nsenter", f"--net={namespace_path(files)}", "--", "/bin/sh", "-c", script)


def run(files: LabPaths, host: str, script: str) -> str:
    """Runs a shell script on a host and returns its stdout.

    Raises ``LabError`` if it fails or the host is off.
    """
    leader = first_process(files, host)
    if leader is None:
        raise LabError(f"host {host} is off", "`swarmctl lab repair` starts it")
    return _run(f"host {host}", argv(leader, script), script)


def run_as_operator(files: LabPaths, script: str) -> str:
    """The same on the operator's side of the lab."""
    return _run("operator", argv_as_operator(files, script), script)


def _run(where: str, command: tuple[str, ...], script: str) -> str:
    try:
        return processes.run(command)
    except LabError as error:
        raise LabError(f"{where}: `{script}` failed: {str(error).rpartition('` failed: ')[2]}") from None


def first_process(files: LabPaths, host: str) -> int | None:
    """Returns the first process of a host, as this machine counts processes; None if the host is off."""
    inside = processes.in_network_namespaces([namespace_path(files, host)])
    leaders = [(depth, pid) for pid in inside if (depth := _depth_of_first(pid))]
    return min(leaders)[1] if leaders else None  # a container's first process is deeper


def _depth_of_first(pid: int) -> int:
    """How many process namespaces a process is in, if it is the first of its own; else 0."""
    try:
        text = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return 0
    found = re.search(r"^NSpid:\s*(.*)$", text, re.MULTILINE)
    ids = found[1].split() if found else []
    return len(ids) if ids and ids[-1] == "1" else 0
