"""A lab's swarm as a person meets it: swarmctl, shells on its hosts, the robots' true motion."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from swarmctl.lab import lab, paths
from swarmctl.lab.hosts import network
from swarmctl.swarm.discovery import has_master
from tests.child_process import child_process
from tests.e2e import forked
from tests.e2e.forked import Process, console_script
from tests.e2e.pose import Pose, printed
from tests.e2e.ros_commands import Ros1, Ros2, RosCommands
from tests.loading import load_swarm
from tests.timing import PATIENCE, wait_for_cpu

SWARMCTL = Path(sys.executable).with_name("swarmctl")
SWARM = "newswarm"
LEADER = "koala-laptop"  # of the paper's example: the one host whose commands are accepted
HOME = f"/opt/swarm/{SWARM}"
SOURCE = f"source {HOME}/current/setup.bash"
IMAGE = 600.0  # s within which the image must have been built and the lab be up
VERB = 120.0  # s within which any other verb must have ended
LOOK_EVERY = 0.005  # s
LONGEST_PAUSE = 0.5  # s

Note = Callable[[str, str, str], None]  # keeps a figure for the table at the end: what, value, bar


class SshError(AssertionError):
    """A command on a host failed; the message is its output."""


@dataclass(frozen=True)
class Run:
    """One finished run of the console script."""

    status: int
    out: str
    err: str
    seconds: float

    def json(self) -> Any:
        return json.loads(self.out)


@dataclass(frozen=True)
class Unit:
    active: str
    pid: int
    restarts: int


def moves(state: Mapping[str, Any]) -> bool:
    return bool(state["left"] or state["right"])


@dataclass(frozen=True)
class Publisher:
    """A stranger on one host that publishes to the ``cmd_vel`` of a robot."""

    swarm: LabSwarm
    host: str
    process: subprocess.Popen[str]
    pid: int

    def kill(self) -> None:
        """SIGKILL, so that the publisher takes leave of nobody."""
        if self.process.poll() is None:
            self.swarm.shell(self.host, f"kill -9 {self.pid}")
            self.process.wait(5)


class LabSwarm:
    """A lab, the spec it was made for, and all that a test does to the two. ``folder`` is its own to fill."""

    def __init__(self, name: str, spec: Path, folder: Path) -> None:
        self.name = name
        self.folder = folder
        self.spec = folder / f"{name}.yaml"
        shutil.copy(spec, self.spec)
        self.deployed: Path | None = None
        self.environment = {
            **os.environ,
            paths.STATE_VARIABLE: str(paths.labs_root().parent),
            "XDG_STATE_HOME": str(folder / "journal"),
            "COLUMNS": "200",
        }
        found, _ = load_swarm(self.spec)
        assert found is not None
        self.hosts: Mapping[str, str] = {host.name: host.address for host in found.hosts.values()}
        self.swarm = found
        self.ros: RosCommands = Ros1() if has_master(found.distro) else Ros2()

    def ros_on(self, host: str) -> RosCommands:
        """The commands of the ROS of ``host``, which may be in no island."""
        found = [one for one in self.swarm.islands if host in one.hosts]
        return self.ros if not found else Ros1() if found[0].has_master else Ros2()

    def up(self, *options: str) -> None:
        done = self._run([str(SWARMCTL), "lab", "up", str(self.spec), "--name", self.name, *options], IMAGE)
        assert done.status == 0, done.out + done.err
        self._namespace = lab.operator(self.name).namespace

    def down(self) -> None:
        lab.down(self.name)

    # The console script

    def argv(self, verb: str, spec: Path | None = None, *options: str) -> list[str]:
        """``verb`` may be of two words, as ``firmware flash``."""
        return [str(SWARMCTL), *verb.split(), str(spec or self.spec), "--lab-name", self.name, *options]

    def swarmctl(self, verb: str, *options: str, spec: Path | None = None) -> Run:
        """One run to its end, in a forked process: to import the package takes longer than most verbs do."""
        return self._run(self.argv(verb, spec, *options), VERB, forked.swarmctl)

    def script(self, verb: str, *options: str, spec: Path | None = None) -> Run:
        """One run of the console script to its end, for tests of how it starts and how long it takes."""
        return self._run(self.argv(verb, spec, *options), VERB)

    def run(self, *arguments: str) -> Run:
        """One run of the console script that has to do with no lab."""
        return self._run([str(SWARMCTL), *arguments], VERB)

    def _run(self, argv: Sequence[str], timeout: float, process: Process = console_script) -> Run:
        began = time.monotonic()
        done = process(argv, self.environment, timeout)
        assert "Traceback" not in done.stderr, done.stderr
        return Run(done.returncode, done.stdout, done.stderr, time.monotonic() - began)

    def begin(
        self, verb: str, *options: str, spec: Path | None = None, through: Sequence[str] = ()
    ) -> subprocess.Popen[str]:
        """The console script under way; its progress lines come on ``stderr``.

        ``through``: the command that runs it.
        """
        self.deployed = None
        return subprocess.Popen(
            [*through, *self.argv(verb, spec, *options)], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True, env=self.environment,
        )  # fmt: skip

    def deploy(self, spec: Path | None = None, *options: str) -> Run:
        return self._deployed(self.swarmctl, spec, *options)

    def timed_deploy(self) -> Run:
        """A deploy that takes as long as it does for a person."""
        return self._deployed(self.script, None)

    def _deployed(self, begin: Callable[..., Run], spec: Path | None, *options: str) -> Run:
        self.deployed = None
        quickly = () if begin == self.script else ("--healthy-for", "0.5")
        run = begin("deploy", *quickly, *options, spec=spec)
        if run.status == 0 and not options:
            self.deployed = spec or self.spec
        return run

    def plan(self, spec: Path | None = None) -> Run:
        return self.swarmctl("plan", "--detailed-exitcode", spec=spec)

    def steps(self, spec: Path | None = None) -> dict[str, list[tuple[str, str, str]]]:
        """By host: kind, target and cause of every step that a deploy would take. Idle hosts are left out."""
        run = self.swarmctl("plan", "--detailed-exitcode", "--json", spec=spec)
        document = run.json()
        steps = {
            host["host"]: [(one["kind"], one["target"], one["cause"]) for one in host["steps"]]
            for host in document["hosts"]
        }
        assert run.status == (2 if any(steps.values()) else 0), run.err
        return {host: found for host, found in steps.items() if found}

    def findings(self, *options: str, spec: Path | None = None) -> dict[str, dict[str, Any]]:
        """Every finding of status that is not ok, by its key."""
        found = self.swarmctl("status", "--json", *options, spec=spec).json()["findings"]
        return {one["key"]: one for one in found if one["state"] not in ("ok", "skipped")}

    def variant(self, name: str, *changes: tuple[str, str]) -> Path:
        """A copy of the spec with each text replaced by another."""
        text = self.spec.read_text()
        for old, new in changes:
            assert text.count(old) == 1, old
            text = text.replace(old, new)
        path = self.folder / f"{name}.yaml"
        path.write_text(text)
        return path

    def settle(self) -> None:
        """Whatever a test did: all plugged in, switched on, deployed as the spec says, and standing still."""
        status = lab.status(self.name)
        for robot in status["robots"]:
            if not robot["plugged"]:
                lab.plug(self.name, robot["name"])
        for one in status["networks"]:
            for host, whole in one["hosts"].items():
                if not whole:
                    self.join(host)
        for host in status["hosts"]:
            if host["state"] == "stopped":
                self.start(host["name"])
        if self.deployed != self.spec:
            run = self.deploy()
            assert run.status == 0, run.out + run.err
        self.seconds_to_standstill(*self.robots())

    # Hosts

    def shell_argv(self, host: str, command: str) -> list[str]:
        ssh, *rest = lab.ssh_argv(self.name, host, [f"bash -c {quoted(command)}"])
        shared = ("-oControlMaster=auto", f"-oControlPath={self._control(host)}", "-oControlPersist=60")
        return ["nsenter", f"--net={self._namespace}", ssh, *shared, *rest]

    def _control(self, host: str) -> Path:
        return self.folder / f"{host}.ssh"

    def hang_up(self, host: str) -> None:
        """Close the connection that the shells of ``host`` share."""
        argv = ["ssh", "-F", "/dev/null", "-o", f"ControlPath={self._control(host)}", "-O", "exit", host]
        subprocess.run(argv, capture_output=True, check=False, timeout=10)

    def shell(self, host: str, command: str, timeout: float = 30) -> str:
        """What ``command`` prints on ``host``; it runs as the spec's user, who has ``sudo``."""
        done = subprocess.run(
            self.shell_argv(host, command), capture_output=True, text=True, timeout=timeout, check=False,
            stdin=subprocess.DEVNULL,
        )  # fmt: skip
        if done.returncode:
            raise SshError(f"{host}: `{command}` ended with {done.returncode}: {done.stderr}{done.stdout}")
        return done.stdout

    def everywhere(self, command: str) -> dict[str, str]:
        return {host: self.shell(host, command) for host in self.hosts}

    def units(self, host: str) -> dict[str, Unit]:
        """The swarm's services on a host, by their names without prefix and suffix."""
        output = self.shell(
            host,
            f"systemctl show -p Id,ActiveState,MainPID,NRestarts "
            f"$(systemctl list-units --all --plain --no-legend 'swarm-{SWARM}.*.service' | cut -d' ' -f1)",
        )
        found = {}
        for paragraph in output.strip().split("\n\n"):
            values = dict(line.split("=", 1) for line in paragraph.splitlines())
            if "Id" in values:
                name = values["Id"].removeprefix(f"swarm-{SWARM}.").removesuffix(".service")
                found[name] = Unit(values["ActiveState"], int(values["MainPID"]), int(values["NRestarts"]))
        return found

    def pids(self) -> dict[str, int]:
        """The main process of every service of the swarm, on every host."""
        return {f"{host}:{name}": unit.pid for host in self.hosts for name, unit in self.units(host).items()}

    def release(self, host: str) -> str:
        return self.shell(host, f"readlink {HOME}/current").strip().removeprefix("releases/")

    def kill(self, host: str) -> None:
        lab.kill(self.name, host)
        self.hang_up(host)

    def start(self, host: str) -> None:
        self.hang_up(host)
        lab.start(self.name, [host], lambda _: None)

    def cut(self, host: str) -> None:
        lab.cut(self.name, host)

    def join(self, host: str) -> None:
        lab.join(self.name, host)

    def reboot(self, host: str) -> float:
        """Reboot from within and wait until SSH answers again. Gives the seconds that took."""
        boots, began = self.boots(host), time.monotonic()
        with suppress(SshError, subprocess.TimeoutExpired):
            self.shell(host, "sudo systemctl reboot", timeout=5)
        self.hang_up(host)
        until(lambda: self.boots(host) == boots + 1, f"{host} does not reboot")
        self.start(host)
        return time.monotonic() - began

    def boots(self, host: str) -> int:
        return next(one["boots"] for one in lab.status(self.name)["hosts"] if one["name"] == host)

    # Robots

    def robots(self) -> dict[str, dict[str, Any]]:
        return lab.robots(self.name)

    def robot(self, name: str) -> dict[str, Any]:
        return self.robots()[name]

    def truth(self, robot: str) -> Pose:
        state = self.robot(robot)
        return Pose(state["x"], state["y"], state["theta"])

    def odometry(self, host: str, robot: str) -> Pose:
        """The pose that the driver of ``robot`` publishes, received on ``host``."""
        echo = f"timeout 10 rostopic echo -n 1 -p /{robot}/odom/pose/pose"
        return printed(self.shell(host, f"{SOURCE}; {echo}"))

    def diagnosis(self, host: str, robot: str) -> str:
        """The next diagnostics of the driver of ``robot``, received on ``host``."""
        return self.shell(host, f"{SOURCE}; {self.ros_on(host).diagnosis(f'{robot}: driver')}")

    @contextmanager
    def driving(self, host: str, robot: str, linear: float, angular: float = 0.0) -> Iterator[Publisher]:
        """Commands at 10 Hz to ``robot``, published on ``host``. Entered once the robot moves."""
        with self.publishing(host, robot, linear, angular) as publisher:
            until(lambda: moves(self.robot(robot)), f"{robot} does not move")
            yield publisher

    @contextmanager
    def publishing(
        self, host: str, robot: str, linear: float, angular: float = 0.0,
        *, source: str = SOURCE, rate: int = 10,
    ) -> Iterator[Publisher]:  # fmt: skip
        publish = self.ros_on(host).publish(f"/{robot}/cmd_vel", linear, angular, rate)
        with self.running(host, publish, source=source) as publisher:
            yield publisher

    @contextmanager
    def running(self, host: str, command: str, *, source: str = SOURCE) -> Iterator[Publisher]:
        """A command on ``host`` that goes on until it is killed."""
        command = f"{source}; echo $$; exec {command}"
        argv = self.shell_argv(host, command)
        nothing = subprocess.DEVNULL
        with child_process(argv, stdin=nothing, stdout=subprocess.PIPE, stderr=nothing) as process:
            assert process.stdout is not None
            publisher = Publisher(self, host, process, int(process.stdout.readline()))
            try:
                yield publisher
            finally:
                with suppress(SshError, subprocess.TimeoutExpired):
                    publisher.kill()

    def seconds_to_standstill(self, *robots: str) -> dict[str, float]:
        """How long each robot still moves, from now on."""
        began, found = time.monotonic(), dict[str, float]()

        def all_stand() -> bool:
            passed, states = time.monotonic() - began, self.robots()
            found.update({name: passed for name in robots if name not in found and not moves(states[name])})
            return len(found) == len(robots)

        until(all_stand, lambda: f"still moving: {set(robots) - set(found)}")
        return found


@contextmanager
def lab_of(name: str, spec: Path, folder: Path, *options: str) -> Iterator[LabSwarm]:
    """A lab of the spec's hosts, gone again on leaving, however it is left."""
    wait_for_cpu()
    swarm = LabSwarm(name, spec, folder)
    with ExitStack() as stack:
        stack.callback(swarm.down)
        swarm.up(*options)
        yield swarm
        for host in swarm.hosts:
            swarm.hang_up(host)


def until(condition: Callable[[], bool], complaint: str | Callable[[], str]) -> float:
    """Wait until ``condition`` holds. Return the seconds that took.

    A condition that takes some time, such as a command on a host, is not evaluated without a pause.
    """
    began = look_began = time.monotonic()
    while not condition():
        if time.monotonic() - began > PATIENCE:
            pytest.fail(complaint if isinstance(complaint, str) else complaint())
        time.sleep(max(LOOK_EVERY, min(time.monotonic() - look_began, LONGEST_PAUSE)))
        look_began = time.monotonic()
    return time.monotonic() - began


def quoted(text: str) -> str:
    return "'" + text.replace("'", "'\\''") + "'"


def namespace_of(swarm: LabSwarm) -> Path:
    return network.namespace_path(paths.lab_paths(swarm.name))
