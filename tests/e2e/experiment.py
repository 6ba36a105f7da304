"""One of the paper's experiments in a lab of its own: deployed, driven with a gamepad, looked at."""

from __future__ import annotations

import os
import re
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from swarmctl.cli import exit_codes
from swarmctl.swarm.resolved import Swarm
from tests import ROOT
from tests.child_process import child_process
from tests.e2e import whole_graph
from tests.e2e.lab_swarm import (
    LEADER,
    SOURCE,
    LabSwarm,
    lab_of,
    moves,
    quoted,
    until,
)
from tests.e2e.security_level import pinned, secured_spec
from tests.timing import PATIENCE

EXAMPLES = ROOT / "examples"
PAD = (EXAMPLES / "gamepad.py").read_text("utf-8")
# Programs whose ROS packages the lab's image lacks.
LACKING = ("gamepad", "kinect", "camera-mount", "rtabmap", "gmapping")
STILL = 1.5  # s within which all robots must stand after the button is let go
TRYING = 1.0  # s to watch for the effect of a command that must be rejected


@dataclass(frozen=True)
class Gamepad:
    """The gamepad of the experiment, in a person's hands."""

    process: subprocess.Popen[str]

    def hold(self, forward: float, left: float = 0.0) -> None:
        self._type(f"{forward} {left}")

    def let_go(self) -> None:
        self._type("")

    def _type(self, line: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()


@dataclass(frozen=True)
class Experiment:
    """A deployed swarm. ``seconds``: what the lab, the deploy and the way to health took."""

    lab: LabSwarm
    spec: Swarm
    seconds: Mapping[str, float]

    @contextmanager
    def gamepad(self, host: str = LEADER) -> Iterator[Gamepad]:
        """A gamepad at the leader's host, or at another one. Entered once its island knows it."""
        argv = self.lab.shell_argv(host, f"{SOURCE}; exec python3 -uc {quoted(PAD)}")
        with child_process(argv, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL) as process:
            (island,) = (one.name for one in self.spec.islands if host in one.hosts)
            until(lambda: self.publishers("/joy", island), "no gamepad is announced")
            yield Gamepad(process)
            assert process.stdin is not None
            process.stdin.close()
            process.wait(PATIENCE)

    def publishers(self, topic: str, island: str) -> list[str]:
        """The nodes other than the joystick that an island's master lists as publishers of ``topic``."""
        ends = whole_graph.real(self.lab, self.spec)[island]
        found = (end.node for end in ends if (end.topic, end.way) == (topic, "publishes"))
        return [node for node in found if node != "/joystick"]

    def settles(self) -> None:
        """Wait until every master lists what the spec says, and nothing else."""
        wanted = whole_graph.expected(self.spec, LACKING)
        wrong: list[str] = []

        def right() -> bool:
            wrong[:] = whole_graph.difference(whole_graph.real(self.lab, self.spec), wanted)
            return not wrong

        with suppress(AssertionError):
            until(right, "")
        assert wrong == [], "\n".join(wrong)

    def drives(self, pad: Gamepad, *robots: str) -> float:
        """Hold the button and push the stick until just ``robots`` move. Gives the seconds that took."""
        before = self.ways()
        time.sleep(0.2)  # the joystick wants to see the button free first
        pad.hold(1.0)
        took = until(lambda: self.moving() >= set(robots), f"not all of {robots} move")
        self.only_these(before, *robots)
        return took

    def only_these(self, before: Mapping[str, float], *robots: str) -> None:
        moved = {name for name, way in self.ways().items() if way != before[name]}
        assert moved == set(robots)

    def moving(self) -> set[str]:
        return {name for name, state in self.lab.robots().items() if moves(state)}

    def ways(self) -> dict[str, float]:
        """How far each robot has come, m."""
        return {name: state["distance"] for name, state in self.lab.robots().items()}

    def stands(self, robot: str, seconds: float = TRYING) -> None:
        """Look for a while: ``robot`` does not move."""
        before, end = self.ways()[robot], time.monotonic() + seconds
        while time.monotonic() < end:
            assert self.ways()[robot] == before, f"{robot} moves"
            time.sleep(0.05)

    def refuses(self, robot: str, received_on: str, stranger: str = "") -> None:
        """Wait until the driver of ``robot`` says that it refuses a stranger; it stands all the while."""
        before = self.ways()[robot]
        refusal = f"refuses {stranger or self.lab.ros.stranger}"
        until(lambda: refusal in self.lab.diagnosis(received_on, robot), "nothing is refused")
        assert self.ways()[robot] == before, f"{robot} has moved"

    def guard_refuses(self, robot: str, host: str, master: str) -> None:
        """Wait until the guard of ``master`` refuses a publisher of ``host``; ``robot`` stands meanwhile."""
        before, topic = self.ways()[robot], self.spec.command_topics[robot].topic
        journal = "sudo journalctl -o cat -u swarm-newswarm.master"
        refusal = re.compile(rf"refused: registerPublisher \S+ {topic} from \S+ \({host}\)")
        until(lambda: refusal.search(self.lab.shell(master, journal)), "nothing is refused")
        assert self.ways()[robot] == before, f"{robot} has moved"

    def receives_nothing(self, robot: str, *, published_on: str, home: str) -> None:
        """A command published on another island never reaches the master of the robot's island."""
        topic = self.spec.command_topics[robot].topic
        until(lambda: self.publishers(topic, published_on), "the command is not announced")
        self.stands(robot)
        assert self.publishers(topic, home) == []

    def seconds_to_rest(self) -> float:
        """How long it takes, from now on, until all robots stand."""
        return max(self.lab.seconds_to_standstill(*self.spec.robots).values())


@contextmanager
def conducted(
    name: str, workplace: Path, prepare: Callable[[LabSwarm], None] = lambda _: None
) -> Iterator[Experiment]:
    """The experiment ``examples/NAME`` in a lab of its own, deployed and healthy; gone on leaving."""
    folder, short = workplace / name, name[: len("paper-1")]
    folder.mkdir()
    began = time.monotonic()
    spec = secured_spec(EXAMPLES / name / "swarm.yaml", folder)
    with lab_of(f"{short}-{os.getpid()}", spec, folder) as swarm:
        up = time.monotonic() - began
        prepare(swarm)
        pinned(swarm)
        deploy = swarm.timed_deploy()
        assert deploy.status == 0, deploy.out + deploy.err
        healthy = seconds_to_health(swarm)
        yield Experiment(
            swarm, swarm.swarm, {"lab up": up, "deployed": deploy.seconds, "then healthy": healthy}
        )


def seconds_to_health(swarm: LabSwarm, spec: Path | None = None) -> float:
    return until(
        lambda: swarm.swarmctl("status", spec=spec).status == exit_codes.OK,
        lambda: swarm.swarmctl("status", spec=spec).out,
    )
