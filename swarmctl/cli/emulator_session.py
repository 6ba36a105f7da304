"""Runs one emulated robot in a terminal: its port, its link, its fault script, and its printed pose."""

from __future__ import annotations

import json as json_format
import math
import signal
import sys
import time
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout, suppress
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from swarmctl.cli import console

if TYPE_CHECKING:
    from swarmctl.lab.emulators.fault_script import Step
    from swarmctl.lab.emulators.serial_robot import Port, Snapshot

LOOK_EVERY = 0.05  # s
PLUG_AGAIN_AFTER = 2.0  # s, once a fault has pulled the cable


def run(port: Port, link: Path | None, steps: Sequence[Step], seconds: float | None, *, json: bool) -> None:
    """Run the robot for ``seconds`` or until Ctrl-C, and print its pose.

    The output of a user's own emulator goes to stderr.
    """
    report = _Report(sys.stdout, json=json)
    with _ended_by_signals(), redirect_stdout(sys.stderr), port, _Link(link) as shown:
        try:
            _Show(port, shown, report, steps).watch(seconds)
        except KeyboardInterrupt:
            report.end(port.snapshot())


@contextmanager
def _ended_by_signals() -> Iterator[None]:
    """End the robot on SIGTERM as on Ctrl-C, so that its link is removed."""

    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


class _Link:
    """A symbolic link to the port while the robot runs. Does nothing without a path."""

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._target: Path | None = None
        if path is not None and path.exists() and not path.is_symlink():
            console.fail(f"{path} exists and is not a symbolic link", "choose another --link, or remove it")

    def show(self, target: Path) -> None:
        if self._path is None:
            return
        try:
            self._path.unlink(missing_ok=True)
            self._path.symlink_to(target)
        except OSError as error:
            console.fail(f"cannot make the link {self._path}: {error.strerror}", "choose another --link")
        self._target = target

    def __enter__(self) -> _Link:
        return self

    def __exit__(self, *_: object) -> None:
        if self._path is not None and self._target is not None:
            with suppress(OSError):
                if self._path.readlink() == self._target:
                    self._path.unlink()


class _Report:
    """Prints the pose of the robot: one live line, or a line for each change of wheel speeds."""

    def __init__(self, out: TextIO, *, json: bool) -> None:
        self._out = out
        self._json = json
        self._live = out.isatty() and not json
        self._began = time.monotonic()
        self._wheels = (0.0, 0.0)
        self._shown_at: float | None = None

    def port(self, path: Path) -> None:
        self._print(json_format.dumps({"port": str(path)}) if self._json else str(path))

    def state(self, snapshot: Snapshot) -> None:
        wheels = (snapshot.left, snapshot.right)
        if self._live:
            self._print(f"\r{self._line(snapshot)}\x1b[K", end="")
        elif wheels != self._wheels:
            self._shown_at = snapshot.distance  # before the line is out: an interrupt may be the answer to it
            self._print(self._line(snapshot))
        self._wheels = wheels

    def end(self, snapshot: Snapshot) -> None:
        """Print the last pose, unless it was already printed."""
        if self._live:
            self._print(f"\r{self._line(snapshot)}\x1b[K")
        elif self._shown_at is not None and self._shown_at != snapshot.distance:
            self._print(self._line(snapshot))

    def _print(self, text: str, end: str = "\n") -> None:
        print(text, end=end, file=self._out, flush=True)

    def _line(self, snapshot: Snapshot) -> str:
        since = time.monotonic() - self._began
        if self._json:
            return json_format.dumps({"time": round(since, 3), **asdict(snapshot)})
        return (
            f"{since:8.2f} s  x {snapshot.x:+.3f} m  y {snapshot.y:+.3f} m  "
            f"theta {math.degrees(snapshot.theta):+.1f} deg  "
            f"wheels {snapshot.left:+.4f} {snapshot.right:+.4f} m/s  {snapshot.last_command!r}"
        )


class _Show:
    """Plays the steps, and prints the port whenever it changes."""

    def __init__(self, port: Port, link: _Link, report: _Report, steps: Sequence[Step]) -> None:
        self._port = port
        self._link = link
        self._report = report
        self._steps = deque(steps)
        self._began = time.monotonic()
        self._path: Path | None = None
        self._held = False  # the script has pulled the cable and will put it back, or not
        self._vanished_at: float | None = None

    def watch(self, seconds: float | None) -> None:
        end = math.inf if seconds is None else self._began + seconds
        self._port.plug()
        while (now := time.monotonic()) < end and not self._port.failure:
            self._play(now)
            self._replug(now)
            if (path := self._port.path) != self._path:
                self._path = path
                if path:
                    self._link.show(path)
                    self._report.port(path)
            self._report.state(self._port.snapshot())
            due = self._began + self._steps[0].at if self._steps else math.inf
            time.sleep(max(0.0, min(LOOK_EVERY, end - now, due - now)))
        self._report.end(self._port.snapshot())

    def _play(self, now: float) -> None:
        while self._steps and self._began + self._steps[0].at <= now:
            step = self._steps.popleft()
            step.apply(self._port)
            self._held = bool(step.unplug) or (self._held and not step.plug)

    def _replug(self, now: float) -> None:
        """Reconnect, after a while, a cable that a fault disconnected."""
        if self._port.path or self._held:
            self._vanished_at = None
        elif self._vanished_at is None:
            self._vanished_at = now
        elif now >= self._vanished_at + PLUG_AGAIN_AFTER:
            self._port.plug()
