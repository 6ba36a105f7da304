"""The one process behind a running lab: it keeps the hosts up, holds the robots, and answers on a socket.

It runs sealed, as the first process of its own process and mount namespaces: when it dies, everything does.
"""

from __future__ import annotations

import os
import select
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

from swarmctl.lab import control, launch, machines, network
from swarmctl.lab.emulated import OWN, robot_of
from swarmctl.lab.emulators import TYPES
from swarmctl.lab.emulators.port import Port
from swarmctl.lab.errors import LabError
from swarmctl.lab.places import Home
from swarmctl.lab.plan import LabHost, LabRobot, Workspace
from swarmctl.lab.processes import environment, run
from swarmctl.lab.state import State, read_state

STARTING, RUNNING, STOPPED = "starting", "running", "stopped"


class Line:
    """A robot and its cable to a host."""

    def __init__(self, robot: LabRobot, place: Path) -> None:
        self.robot = robot
        self.port = Port(robot_of(robot.emulator, robot.measured), place / "ptmx")

    def wire(self, leader: int | None) -> None:
        """Make the device appear in the running host, or vanish from it, as the cable is in or out."""
        if leader is None:
            return
        device = Path(f"/proc/{leader}/root{self.robot.device}")
        with suppress(OSError):  # a host that goes down in this moment has no devices
            device.unlink(missing_ok=True)
            if path := self.port.path:
                device.parent.mkdir(parents=True, exist_ok=True)
                device.symlink_to(f"{machines.PTS_INSIDE}/{path.name}")

    def report(self) -> dict[str, Any]:
        return asdict(self.port.snapshot())


class Keeper(threading.Thread):
    """Keeps one host as it is wanted: boots it, boots it again when it reboots, leaves it off when it is off.

    The host dies with this thread, which is why the thread never ends.
    """

    def __init__(
        self, host: LabHost, home: Home, groups: machines.Cgroups, workspace: Workspace | None
    ) -> None:
        super().__init__(name=host.name, daemon=True)
        self.host = host
        self.lines: list[Line] = []
        self._place = home.host(host.name)
        self._namespace = network.namespace_path(home, host.name)
        self._groups = groups
        self._workspace = workspace
        self._change = threading.Condition()
        self._wanted = True
        self._state = STOPPED
        self._leader: int | None = None
        self._boots = 0
        self._since = time.time()
        self._status: int | None = None

    def run(self) -> None:
        while True:
            with self._change:
                while not self._wanted:
                    self._change.wait()
                self._enter(STARTING)
                self._boots += 1
            try:
                network.set_power(self.host, self._namespace.name, on=True)
                status = self._boot()
                network.set_power(self.host, self._namespace.name, on=False)
            except (OSError, LabError) as error:
                with self._place.log.open("a") as log:
                    log.write(f"{error}\n")
                status = None
            with self._change:
                self._leader, self._status = None, status
                self._wanted = self._wanted and status == machines.REBOOT
                self._enter(STOPPED)

    def start_host(self) -> None:
        with self._change:
            self._wanted = True
            self._change.notify()

    def kill_host(self) -> None:
        """Cut the power: nothing inside gets a chance to finish."""
        with self._change:
            self._wanted = False
            if self._leader is not None:
                with suppress(ProcessLookupError):  # it is going down already
                    os.kill(self._leader, signal.SIGKILL)

    def wire(self) -> None:
        for line in self.lines:
            line.wire(self._leader)

    def report(self) -> dict[str, Any]:
        with self._change:
            return {
                "state": self._state,
                "since": self._since,
                "boots": self._boots,
                "wanted": self._wanted,
                "exit": self._status,
            }

    def _enter(self, state: str) -> None:
        self._state, self._since = state, time.time()

    def _boot(self) -> int:
        """One life of the host, from power on to its end. Gives the exit status of systemd-nspawn."""
        folders = [group / self.host.name for group in self._groups.all]
        for folder in folders:
            machines.drop_cgroup(folder)
            folder.mkdir(parents=True)
        ready = self._place.directory / "ready"
        ready.unlink(missing_ok=True)
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as messages, self._place.log.open("ab") as log:
            folder_of_ready = os.open(self._place.directory, os.O_PATH | os.O_DIRECTORY)
            address = f"/proc/{os.getpid()}/fd/{folder_of_ready}/{ready.name}"
            messages.bind(address)
            argv = machines.nspawn_argv(self.host, self._place, self._namespace, self._workspace)
            process = subprocess.Popen(
                machines.joining(argv, folders),
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
                env={**environment(), **machines.nspawn_environment(self._groups), "NOTIFY_SOCKET": address},
            )
            self._follow(process, messages)
            os.close(folder_of_ready)
            status = process.wait()
        if status < 0 and self._leader is not None:  # somebody killed systemd-nspawn; its host outlives it
            os.kill(self._leader, signal.SIGKILL)
            os.waitpid(self._leader, 0)
        return status

    def _follow(self, process: subprocess.Popen[bytes], messages: socket.socket) -> None:
        ending = os.pidfd_open(process.pid)
        try:
            while True:
                ready, _, _ = select.select([ending, messages.fileno()], [], [])
                if messages.fileno() in ready:
                    self._hear(messages.recv(4096).decode(errors="replace"))
                elif ending in ready:
                    return
        finally:
            os.close(ending)

    def _hear(self, message: str) -> None:
        """What systemd-nspawn says: the first process is there, or its systemd has finished starting."""
        said = dict(line.partition("=")[::2] for line in message.splitlines())
        with self._change:
            if leader := said.get("X_NSPAWN_LEADER_PID"):
                self._leader = int(leader)
                if not self._wanted:
                    os.kill(self._leader, signal.SIGKILL)
            if said.get("READY") == "1":
                self._enter(RUNNING)
        if leader:
            self.wire()


class Supervisor:
    """All hosts and robots of one lab, and the answers to what ``swarmctl lab`` asks."""

    def __init__(self, home: Home, state: State) -> None:
        plan = state.plan
        groups = machines.cgroups(
            Path("/proc/self/mountinfo").read_text(),
            Path("/proc/self/cgroup").read_text(),
            home.tag,
            delegated=launch.SYSTEMD_RUNS.is_dir(),
        )
        for host in plan.hosts:
            for argv in machines.mount_argvs(state.image, home.host(host.name)):
                run(argv)
        self.keepers = {host.name: Keeper(host, home, groups, plan.workspace) for host in plan.hosts}
        self.lines: dict[str, Line] = {}
        for robot in plan.robots:
            if robot.emulator:
                line = Line(robot, home.host(robot.host).pts)
                line.port.plug()
                self.lines[robot.name] = line
                self.keepers[robot.host].lines.append(line)
        self._verbs: dict[str, Callable[[str], None]] = {
            "status": lambda _: None,
            "plug": self._plug,
            "unplug": self._unplug,
            "kill": self._kill,
            "start": self._start,
        }

    def start(self) -> None:
        for keeper in self.keepers.values():
            keeper.start()

    def answer(self, request: Mapping[str, str]) -> Mapping[str, Any]:
        verb, subject = self._verbs.get(request.get("do", "")), request.get("what", "")
        if verb is None:
            raise LabError(
                f"this lab knows no `{request.get('do')}`", "it may have been made by another swarmctl"
            )
        verb(subject)
        return {
            "hosts": {name: keeper.report() for name, keeper in self.keepers.items()},
            "robots": {name: line.report() for name, line in self.lines.items()},
        }

    def _plug(self, name: str) -> None:
        line = self._line(name)
        line.port.plug()
        self.keepers[line.robot.host].wire()

    def _unplug(self, name: str) -> None:
        line = self._line(name)
        line.port.unplug()
        self.keepers[line.robot.host].wire()

    def _kill(self, name: str) -> None:
        self._keeper(name).kill_host()

    def _start(self, name: str) -> None:
        self._keeper(name).start_host()

    def _keeper(self, name: str) -> Keeper:
        if name not in self.keepers:
            raise LabError(f"there is no host `{name}`", f"there are {', '.join(self.keepers)}")
        return self.keepers[name]

    def _line(self, name: str) -> Line:
        if name not in self.lines:
            raise LabError(
                f"robot {name} has no emulator",
                f"there are emulators for {', '.join(TYPES)}; one of your own is robots/TYPE{OWN}",
            )
        return self.lines[name]


def main(directory: str) -> None:
    home = Home(Path(directory))
    log = os.open(home.log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
    for stream in (1, 2):
        os.dup2(log, stream)
    supervisor = Supervisor(home, read_state(home))
    server = control.listen(home.socket)
    supervisor.start()
    control.serve(server, supervisor.answer)


if __name__ == "__main__":
    main(sys.argv[1])
