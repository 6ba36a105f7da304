"""The processes of systemd units, from /proc: what they run, their state, the ports on which they listen."""

from __future__ import annotations

import os
from contextlib import suppress

from .named_tuple import NamedTuple
from .observations import LoadSeen
from .texts import clipped

TYPE_CHECKING = False

if TYPE_CHECKING:
    from typing import Iterator, Mapping, Sequence


_SHORTEST = 50  # clock ticks of 10 ms
_MOST_NAMED = 3


class Work(NamedTuple):
    """How long the processors have worked since the boot, that time with the time they rested, and by number
    the name of each process that this host sees with its own time; all in clock ticks.
    """

    busy: int
    all: int
    processes: Mapping[int, tuple[str, int]]

    def since(self, before: Work) -> LoadSeen | None:
        """Returns the load since ``before``; None after less than 0.5 s."""
        passed = self.all - before.all
        if passed < _SHORTEST * (os.cpu_count() or 1):
            return None
        ticks = {
            pid: now - before.processes[pid][1]
            for pid, (_, now) in self.processes.items()
            if pid in before.processes
        }
        first = sorted(ticks, key=lambda pid: -ticks[pid])[:_MOST_NAMED]
        return LoadSeen(
            (self.busy - before.busy) / passed,
            sum(ticks.values()) / passed,
            [clipped(f"{self.processes[pid][0]} ({pid})") for pid in first],
        )


def processor_work() -> Work:
    """Returns what the processors have done so far (proc_stat(5), proc_pid_stat(5))."""
    with open("/proc/stat", encoding="ascii") as file:
        ticks = [int(word) for word in file.readline().split()[1:9]]
    idle, waiting_for_disks = ticks[3:5]
    processes = {}
    for pid in filter(str.isdigit, os.listdir("/proc")):
        with suppress(OSError):  # it has ended
            with open(f"/proc/{pid}/stat", encoding="utf-8", errors="replace") as file:
                name, _, fields = file.read().partition("(")[2].rpartition(") ")
            user, system = fields.split()[11:13]
            processes[int(pid)] = name, int(user) + int(system)
    return Work(sum(ticks) - idle - waiting_for_disks, sum(ticks), processes)


_STOPPED = "Tt"  # by a signal, by a debugger (proc_pid_stat(5))
_LISTENING = "0A"  # TCP_LISTEN in the column `st` of /proc/net/tcp
_INTERPRETERS = ("python", "sh", "bash", "dash", "perl")


class Process(NamedTuple):
    """A process: its number, the letter of its state as in proc_pid_stat(5), its command line."""

    pid: int
    state: str
    words: Sequence[str]

    @property
    def stopped(self) -> bool:
        """True if a signal or a debugger has stopped it."""
        return self.state in _STOPPED

    @property
    def name(self) -> str:
        """The program it runs; for an interpreter, the script."""
        names = [os.path.basename(word) for word in self.words[:2]] or [""]
        script = names[0].rstrip("0123456789.") in _INTERPRETERS and not self.words[-1].startswith("-")
        return names[-1] if script else names[0]


def of_units(groups: Mapping[str, str], proc: str = "/proc") -> dict[str, list[Process]]:
    """The processes of each unit. ``groups``: the control group of each, empty for one that does not run."""
    found: dict[str, list[Process]] = {unit: [] for unit in groups}
    for pid in sorted(int(name) for name in os.listdir(proc) if name.isdigit()):
        with suppress(OSError, IndexError):  # it has ended
            paths = [line.rpartition(":")[2] + "/" for line in _read(f"{proc}/{pid}/cgroup").splitlines()]
            for unit, group in groups.items():
                # Seen from outside a container, the path begins with the group of the container.
                if group and any(group + "/" in path for path in paths):
                    found[unit].append(_process(proc, pid))
    return found


def _process(proc: str, pid: int) -> Process:
    state = _read(f"{proc}/{pid}/stat").rpartition(")")[2].split()[0]
    return Process(pid, state, _read(f"{proc}/{pid}/cmdline").rstrip("\0").split("\0"))


def listening_ports(pid: int = 0, proc: str = "/proc") -> list[int]:
    """The TCP ports on which a process listens, or any of the host. Raises ``OSError`` if it has ended."""
    sockets = set(_sockets(f"{proc}/{pid}/fd")) if pid else None
    ports = {
        int(fields[1].rpartition(":")[2], 16)
        for fields in _table(proc, str(pid or "self"), ("tcp", "tcp6"))
        if fields[3] == _LISTENING and (sockets is None or fields[9] in sockets)
    }
    return sorted(ports)


def udp_ports(proc: str = "/proc") -> list[int]:
    """The UDP ports that processes of the host have."""
    return sorted({int(fields[1].rpartition(":")[2], 16) for fields in _table(proc, "self", ("udp", "udp6"))})


def _table(proc: str, process: str, names: Sequence[str]) -> Iterator[list[str]]:
    """The fields of each socket in tables of the kernel (proc_pid_net(5))."""
    for name in names:
        with suppress(FileNotFoundError):  # a kernel without IPv6
            yield from (line.split() for line in _read(f"{proc}/{process}/net/{name}").splitlines()[1:])


def _sockets(folder: str) -> Iterator[str]:
    """The inodes of a process's sockets."""
    for name in os.listdir(folder):
        try:
            target = os.readlink(f"{folder}/{name}")
        except OSError:  # closed meanwhile
            continue
        if target.startswith("socket:["):
            yield target[len("socket:[") : -1]


def _read(path: str) -> str:
    with open(path, encoding="utf-8", errors="replace") as file:
        return file.read()
