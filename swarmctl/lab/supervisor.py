"""The process of a running lab: boots the hosts, runs the emulated robots, and answers requests on a socket.

It is the first process of its own process and mount namespaces: when it ends, the kernel ends the whole lab.
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

from swarmctl.lab import supervisor_client
from swarmctl.lab.driver_stand_ins import StandIn, state_in
from swarmctl.lab.emulators import TYPES
from swarmctl.lab.emulators.emulator_lookup import EMULATOR_SUFFIX, build_robot
from swarmctl.lab.emulators.serial_faults import Faults
from swarmctl.lab.emulators.serial_robot import Port
from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import network, nspawn
from swarmctl.lab.hosts.processes import environment, run
from swarmctl.lab.lab_plan import LabHost, LabRobot, Workspace
from swarmctl.lab.lab_state import State, read_state
from swarmctl.lab.paths import LabPaths

STARTING, RUNNING, STOPPED = "starting", "running", "stopped"


class RobotLine:
    """An emulated robot and its cable to a host."""

    def __init__(self, robot: LabRobot, terminals: Path) -> None:
        self.robot = robot
        self.port = Port(build_robot(robot.emulator, robot.measured), terminals / "ptmx")
        self.battery = self.port.robot.battery  # at first

    def link_device(self, leader: int | None) -> None:
        """Creates or removes the device in a running host; ``leader`` is the host's first process."""
        if leader is None:
            return
        device = Path(f"/proc/{leader}/root{self.robot.device}")
        with suppress(OSError):  # the host may be going down
            device.unlink(missing_ok=True)
            if path := self.port.path:
                device.parent.mkdir(parents=True, exist_ok=True)
                device.symlink_to(f"{nspawn.PTS_INSIDE}/{path.name}")

    def report(self) -> dict[str, Any]:
        """Returns the robot's state as JSON data."""
        return asdict(self.port.snapshot())


class HostRunner(threading.Thread):
    """Boots one host, boots it again after a reboot, and leaves it off after a power-off or kill.

    The kernel kills the host when this thread ends, so the thread never ends.
    """

    def __init__(
        self,
        host: LabHost,
        files: LabPaths,
        groups: nspawn.Cgroups,
        workspace: Workspace | None,
        engines: tuple[str, ...],
    ) -> None:
        super().__init__(name=host.name, daemon=True)
        self.host = host
        self.lines: list[RobotLine] = []
        self._files = files.host(host.name)
        self._namespace = network.namespace_path(files, host.name)
        self._groups = groups
        self._workspace, self._engines = workspace, engines
        self._change = threading.Condition()
        self._wanted = True
        self._state = STOPPED
        self._leader: int | None = None
        self._boots = 0
        self._since = time.time()
        self._status: int | None = None

    def run(self) -> None:
        """Boots the host whenever it is wanted, and waits until it ends."""
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
                with self._files.log.open("a") as log:
                    log.write(f"{error}\n")
                status = None
            with self._change:
                self._leader, self._status = None, status
                self._wanted = self._wanted and status == nspawn.REBOOT
                self._enter(STOPPED)

    def start_host(self) -> None:
        """Switches the host on; ``run`` boots it."""
        with self._change:
            self._wanted = True
            self._change.notify()

    def kill_host(self) -> None:
        """Kills the host without a shutdown, like a power cut."""
        with self._change:
            self._wanted = False
            if self._leader is not None:
                with suppress(ProcessLookupError):  # it is already going down
                    os.kill(self._leader, signal.SIGKILL)

    def state_of(self, stand_in: StandIn) -> dict[str, Any]:
        """Returns the state of a robot whose stand-in runs on this host, as JSON data."""
        leader = self._leader
        return state_in(None if leader is None else Path(f"/proc/{leader}/root"), stand_in)

    def link_devices(self) -> None:
        """Links the robots' ports into the running host."""
        for line in self.lines:
            line.link_device(self._leader)

    def report(self) -> dict[str, Any]:
        """Returns the host's state as JSON data."""
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
        """Runs the host from power-on to its end and returns the exit status of systemd-nspawn."""
        folders = [group / self.host.name for group in self._groups.all]
        for folder in folders:
            nspawn.remove_cgroup(folder)
            folder.mkdir(parents=True)
        ready = self._files.directory / "ready"
        ready.unlink(missing_ok=True)
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as messages, self._files.log.open("ab") as log:
            descriptor = os.open(self._files.directory, os.O_PATH | os.O_DIRECTORY)
            address = f"/proc/{os.getpid()}/fd/{descriptor}/{ready.name}"
            messages.bind(address)
            place = self._files, self._namespace
            argv = nspawn.nspawn_argv(self.host, *place, self._workspace, self._engines)
            process = subprocess.Popen(
                nspawn.in_cgroups(argv, folders),
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
                env={**environment(), **nspawn.nspawn_environment(self._groups), "NOTIFY_SOCKET": address},
            )
            self._follow(process, messages)
            os.close(descriptor)
            status = process.wait()
        if status < 0 and self._leader is not None:  # systemd-nspawn was killed; its host outlives it
            os.kill(self._leader, signal.SIGKILL)
            os.waitpid(self._leader, 0)
        return status

    def _follow(self, process: subprocess.Popen[bytes], messages: socket.socket) -> None:
        ending = os.pidfd_open(process.pid)
        try:
            while True:
                ready, _, _ = select.select([ending, messages.fileno()], [], [])
                if messages.fileno() in ready:
                    self._notified(messages.recv(4096).decode(errors="replace"))
                elif ending in ready:
                    return
        finally:
            os.close(ending)

    def _notified(self, message: str) -> None:
        """Handles a message of systemd-nspawn: the first process exists, or its systemd has started."""
        fields = dict(line.partition("=")[::2] for line in message.splitlines())
        with self._change:
            if leader := fields.get("X_NSPAWN_LEADER_PID"):
                self._leader = int(leader)
                if not self._wanted:
                    os.kill(self._leader, signal.SIGKILL)
            if fields.get("READY") == "1":
                self._enter(RUNNING)
        if leader:
            self.link_devices()


class Supervisor:
    """All hosts and robots of one lab, and the handler of requests from ``swarmctl lab``."""

    def __init__(self, files: LabPaths, state: State) -> None:
        plan = state.plan
        groups = nspawn.cgroups(
            Path("/proc/self/mountinfo").read_text(),
            Path("/proc/self/cgroup").read_text(),
            files.tag,
            delegated=supervisor_client.SYSTEMD_RUNS.is_dir(),
        )
        for host in plan.hosts:
            for argv in nspawn.mount_argvs(state.images[host.distro], files.host(host.name)):
                run(argv)
        self.runners = {
            host.name: HostRunner(host, files, groups, plan.workspace, plan.engines) for host in plan.hosts
        }
        self._stand_ins = state.stand_ins
        self.lines: dict[str, RobotLine] = {}
        for robot in plan.robots:
            if robot.emulator:
                line = RobotLine(robot, files.host(robot.host).pts)
                line.port.plug()
                self.lines[robot.name] = line
                self.runners[robot.host].lines.append(line)
        self._verbs: dict[str, Callable[[str], None]] = {
            "status": lambda _: None,
            "plug": self._plug,
            "unplug": self._unplug,
            "stall": self._stall,
            "resume": self._resume,
            "battery": self._drain,
            "recharge": self._recharge,
            "kill": self._kill,
            "start": self._start,
        }

    def start(self) -> None:
        """Starts the threads of all hosts."""
        for runner in self.runners.values():
            runner.start()

    def answer(self, request: Mapping[str, str]) -> Mapping[str, Any]:
        """Carries out a request and returns the state of all hosts and robots. Raises ``LabError``."""
        verb, subject = self._verbs.get(request.get("do", "")), request.get("what", "")
        if verb is None:
            raise LabError(
                f"this lab has no command `{request.get('do')}`",
                "it was started by another version: run `lab down`, then `lab up`",
            )
        verb(subject)
        return {
            "hosts": {name: runner.report() for name, runner in self.runners.items()},
            "robots": self._robots(),
        }

    def _robots(self) -> dict[str, dict[str, Any]]:
        found = {name: line.report() for name, line in self.lines.items()}
        for one in self._stand_ins:
            plugged = found[one.robot]["plugged"] if one.robot in found else True
            found[one.robot] = {**self.runners[one.host].state_of(one), "plugged": plugged}
        return found

    def _plug(self, name: str) -> None:
        line = self._line(name)
        line.port.plug()
        self.runners[line.robot.host].link_devices()

    def _unplug(self, name: str) -> None:
        line = self._line(name)
        line.port.unplug()
        self.runners[line.robot.host].link_devices()

    def _stall(self, name: str) -> None:
        self._line(name).port.faults = Faults(stuck=True, drop=1.0)

    def _resume(self, name: str) -> None:
        self._line(name).port.faults = Faults()

    def _drain(self, words: str) -> None:
        """``words``: a robot, and how full its battery is, 0 to 1."""
        name, share = words.split()
        with self._line(name).port.now() as robot:
            robot.battery = float(share)

    def _recharge(self, name: str) -> None:
        line = self._line(name)
        with line.port.now() as robot:
            robot.battery = line.battery

    def _kill(self, name: str) -> None:
        self._runner(name).kill_host()

    def _start(self, name: str) -> None:
        self._runner(name).start_host()

    def _runner(self, name: str) -> HostRunner:
        if name not in self.runners:
            raise LabError(f"there is no host `{name}`", f"the hosts are {', '.join(self.runners)}")
        return self.runners[name]

    def _line(self, name: str) -> RobotLine:
        if name not in self.lines:
            raise LabError(
                f"robot {name} has no emulator",
                f"there are emulators for {', '.join(TYPES)}; write your own as robots/TYPE{EMULATOR_SUFFIX}",
            )
        return self.lines[name]


def main(directory: str) -> None:
    """Runs the supervisor of the lab in ``directory``; stdout and stderr go to its log."""
    files = LabPaths(Path(directory))
    log = os.open(files.log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
    for stream in (1, 2):
        os.dup2(log, stream)
    supervisor = Supervisor(files, read_state(files))
    server = supervisor_client.listen(files.socket)
    supervisor.start()
    supervisor_client.serve(server, supervisor.answer)


if __name__ == "__main__":
    main(sys.argv[1])
