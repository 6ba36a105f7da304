"""Cuts the power of a host at every system call of a scene, or at random instants, and boots it again."""

from __future__ import annotations

import random
import signal
import subprocess
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from tests.onboard.agent.fakehost import FakeHost
from tests.power import isolated, tracer
from tests.power.disk import Disk, Snapshot, identity
from tests.power.host_states import KNOWN, LAST, STATES, Finding, boot, look
from tests.power.scenes import SCENES, Scene, follow
from tests.timing import PATIENCE

END = "after the answer"
_INSTANTS = 7  # parts of a scene, between which the kernel writes all
REACHED = "/mnt/reached"  # is made in place of a sync that was taken away
RANDOM = ", random"  # ends the name of a row of cuts at random instants


class Cut(NamedTuple):
    """``at``: the system call before which the power went, or the time."""

    at: str
    snapshot: Snapshot


@dataclass
class Row:
    """What came of the cuts of one scene. ``images``: how many left different images, each booted once;
    ``deploys``: after how many of these a further deploy was made."""

    system: str
    log: str
    scene: str
    cuts: int = 0
    images: int = 0
    deploys: int = 0
    states: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    leftovers: Counter[str] = field(default_factory=Counter)

    def add(self, at: str, finding: Finding, problem: str) -> None:
        """Counts one cut."""
        self.cuts += 1
        self.states[finding.state] += 1
        self.leftovers.update(set(finding.leftovers))
        if problem:
            self.wrong.append(f"{self.system}, log {self.log}, {self.scene}, {at}: {problem}")


class Bench:
    """A host whose disk is cut again and again. For a process of its own: see ``isolated``."""

    def __init__(
        self, folder: Path, kind: str, known: Mapping[str, dict[str, str]], deploys_each: int
    ) -> None:
        self.disk = Disk(folder, kind)
        self.folder = folder
        self.known = known
        self.deploys_each = deploys_each
        self.disk.attach()
        self.host = FakeHost(self.disk.mount / "host")
        self.disk.flush_log()
        self.disk.detach()
        self.blank = self.disk.snapshot()

    def at_every_call(self, scene: Scene, log: str, sparse: int = 1, *, first: bool = False) -> Row:
        """Cuts before each system call of ``scene`` that changes files, one of ``sparse``, and at the end.

        With ``first`` a sync was taken away: a scene without it is not cut, and the first loss ends another.
        """
        row = Row(self.disk.kind, log, scene.name)
        seen: dict[object, tuple[Finding, str]] = {}
        cuts = self._recorded(scene, log)
        if first and not Path(REACHED).exists():
            return row
        instants = [len(cuts) * one // _INSTANTS for one in range(1, _INSTANTS)] if log == "once" else [-1]
        for instant in instants:
            for number, cut in enumerate(self._recorded(scene, log, instant) if instant >= 0 else cuts):
                if number < instant or (cut.at != END and number % sparse) or (first and row.wrong):
                    continue
                key = (identity(cut.snapshot), cut.at == END)
                if key not in seen:
                    self.disk.restore(cut.snapshot)
                    seen[key] = self._verdict(scene, cut.at == END, row)
                written = f"written at call {instant}, " if instant >= 0 else ""
                at = f"cut {number}, before {cut.at}" if cut.at != END else END
                row.add(f"{written}{at}", *seen[key])
        return row

    def at_random(self, scene: Scene, log: str, times: int, seed: int) -> Row:
        """Cuts the mounted file system by its shutdown ioctl, at instants while the scene runs."""
        row = Row(self.disk.kind, log, f"{scene.name}{RANDOM}")
        base = self._prepared(scene)
        choice = random.Random(seed)
        longest = 0.0
        for number in range(times + 1):
            self.disk.restore(base)
            self.disk.attach()
            scene.unwritten(self.host)
            began = time.monotonic()
            process = self._started(scene)
            if number == 0:  # the measure of the others
                assert process.wait(PATIENCE) == 0
                longest = time.monotonic() - began
                self.disk.detach()
                continue
            instant = choice.uniform(0, 1.05 * longest)
            time.sleep(max(0.0, began + instant - time.monotonic()))
            self.disk.cut(log)
            process.send_signal(signal.SIGKILL)
            process.wait(PATIENCE)
            self.disk.detach()
            row.add(f"after {instant * 1e3:.1f} ms", *self._verdict(scene, False, row))
        return row

    def _prepared(self, scene: Scene) -> Snapshot:
        """The disk of the host before the scene, all of it written."""
        self.disk.restore(self.blank)
        self.disk.attach()
        scene.prepare(self.host)
        self.disk.detach()
        return self.disk.snapshot()

    def _recorded(self, scene: Scene, log: str, instant: int = -1) -> list[Cut]:
        """Runs the scene once; what a cut at each instant leaves on the disk, which all is written to before
        the system call ``instant``."""
        self.disk.restore(self._prepared(scene))
        self.disk.attach()
        scene.unwritten(self.host)
        Path(REACHED).unlink(missing_ok=True)
        found: list[Cut] = []

        def before(call: str) -> None:
            if log == "flushed":
                self.disk.flush_log()
            elif len(found) == instant:
                self.disk.write_all()
            found.append(Cut(call, self.disk.snapshot()))

        command, environment, given = scene.process(self.host)
        request = self.folder / "request"
        request.write_bytes(given)
        status = tracer.trace(command, environment, request, str(self.disk.mount), before)
        before(END)
        self.disk.detach()
        assert status == 0, f"{scene.name} ended with {status}"
        return found

    def _started(self, scene: Scene) -> subprocess.Popen[bytes]:
        command, environment, given = scene.process(self.host)
        request = self.folder / "request"
        request.write_bytes(given)
        with request.open("rb") as file:
            return subprocess.Popen(
                command,
                env=environment,
                stdin=file,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )

    def _verdict(self, scene: Scene, ended: bool, row: Row) -> tuple[Finding, str]:
        """Mounts the cut disk, boots, looks, and deploys once more on some. Returns what is wrong, too."""
        row.images += 1
        self.disk.attach()
        try:
            try:
                problem = boot(self.host, 2)
                finding = look(self.host, self.known)
            except (OSError, ValueError, LookupError) as error:  # a lost file, or text
                problem, finding = "", Finding("mixed", "", (repr(error),))
            if not problem and finding.state not in ({scene.ends} if ended else scene.may):
                problem = "; ".join(finding.faults) or f"the host is {finding.state}"
            if ended and scene.clean and not problem and finding.leftovers:
                problem = f"left over: {', '.join(finding.leftovers)}"
            if not problem and row.images % self.deploys_each == 0:
                row.deploys += 1
                problem = self._next_deploy(finding)
            return finding, problem
        finally:
            self.disk.detach()

    def _next_deploy(self, found: Finding) -> str:
        """Deploys to a host that was cut. Returns what is wrong with the result."""
        # A release that was to be repaired is the old one.
        before = None if found.release == "none" else STATES.get(found.release, STATES["old"]).bundle
        keys = KNOWN if found.keys or any("wireguard" in one for one in found.leftovers) else ""
        reply = self.host.ask(*follow(before, LAST, keys))
        if reply.error or reply.status:
            return f"the next deploy fails: {reply}"
        finding = look(self.host, self.known)
        if finding.release != "last" or bool(finding.keys) != bool(keys) or finding.leftovers:
            return f"after the next deploy: {finding}"
        return ""


class Job(NamedTuple):
    """A file system, what becomes of its log, the number of a scene, whether to cut at random instants."""

    system: str
    log: str
    scene: int
    at_random: bool


class Effort(NamedTuple):
    """Of ``sparse`` system calls one is cut; each scene has ``times`` cuts at random instants, drawn from
    ``seed``; a further deploy follows on one of ``deploys_each`` images; ``first``: see ``at_every_call``."""

    sparse: int
    times: int
    seed: int
    deploys_each: int
    first: bool


def run(job: Job, known: Mapping[str, dict[str, str]], effort: Effort) -> Row:
    """Makes the cuts of one scene. For a process of its own."""
    with isolated.folder() as folder:
        bench = Bench(folder, job.system, known, effort.deploys_each)
        if job.at_random:
            return bench.at_random(SCENES[job.scene], job.log, effort.times, effort.seed)
        return bench.at_every_call(SCENES[job.scene], job.log, effort.sparse, first=effort.first)
