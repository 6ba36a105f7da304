"""A teleop program as a process of its own: fake ROS at one end, a joystick or a terminal at the other."""

from __future__ import annotations

import contextlib
import json
import os
import pty
import select
import signal
import struct
import subprocess
import sys
import termios
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from swarmctl.resources import onboard
from tests.timing import wait_for

TELEOP = onboard() / "nodes/teleop"
FAKE_ROS = Path(__file__).parent / "fake_ros"
ROBOTS = ("koala", "epuck")
STAMPED = "epuck"  # its driver takes TwistStamped
DEADMAN = 4


class World:
    """A folder with a parameter file and what the fake ROS publishes and subscribes to."""

    def __init__(self, folder: Path, node: str, **params: Any) -> None:
        self.folder = folder
        self.config = folder / "params.yaml"
        self.log = folder / "log"
        targets = [
            {"robot": name, "topic": f"/{name}/cmd_vel", **({"stamped": True} if name == STAMPED else {})}
            for name in ROBOTS
        ]
        self.config.write_text(yaml.safe_dump({"node": node, "targets": targets, "params": params}))
        os.mkfifo(folder / "joy")
        (folder / "published").touch()
        self._joy = os.open(folder / "joy", os.O_RDWR)

    @property
    def environment(self) -> dict[str, str]:
        return {**os.environ, "PYTHONPATH": f"{FAKE_ROS}:{onboard().parent}", "FAKE_ROS": str(self.folder)}

    def command(self, program: str) -> list[str]:
        return [sys.executable, str(TELEOP / program), "--config", str(self.config)]

    def flag(self, name: str) -> None:
        (self.folder / name).touch()

    def records(self) -> list[dict[str, Any]]:
        lines = (self.folder / "published").read_text().splitlines(keepends=True)
        return [json.loads(line) for line in lines if line.endswith("\n")]

    def commands(self, robot: str = "koala") -> list[tuple[float, float]]:
        """Every twist that a robot was sent, in order."""
        topic = f"/{robot}/cmd_vel"
        return [(one["linear"], one["angular"]) for one in self.records() if one.get("topic") == topic]

    def joy(self, *axes: float, held: bool, buttons: int = 8) -> None:
        message = {"axes": axes, "buttons": [int(held and number == DEADMAN) for number in range(buttons)]}
        os.write(self._joy, (json.dumps(message) + "\n").encode())

    def close(self) -> None:
        os.close(self._joy)


class Joystick:
    """A device in the kernel's manner: 8-byte events, the whole state first."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = -1

    def plug(self, axes: int = 2, buttons: int = 8, held: tuple[int, ...] = ()) -> None:
        hidden = self.path.with_suffix(".hidden")
        os.mkfifo(hidden)
        self._file = os.open(hidden, os.O_RDWR)
        self.send(*((0, 0x82, number) for number in range(axes)))
        self.send(*((int(number in held), 0x81, number) for number in range(buttons)))
        hidden.rename(self.path)  # there all at once, as a device is

    def unplug(self) -> None:
        self.path.unlink()
        os.close(self._file)

    def send(self, *events: tuple[int, int, int]) -> None:
        os.write(self._file, b"".join(struct.pack("=IhBB", 0, *event) for event in events))

    def push(self, axis: int, value: int) -> None:
        self.send((value, 0x02, axis))

    def press(self, button: int, down: bool = True) -> None:
        self.send((int(down), 0x01, button))


class Keyboard:
    """A program in a terminal of its own, the controlling one; ``screen`` is what it showed."""

    def __init__(self, world: World) -> None:
        arguments, environment = world.command("teleop_key.py"), world.environment
        self.pid, self._master = pty.fork()
        if self.pid == 0:
            os.execve(arguments[0], arguments, environment)
        self.screen = b""
        self.status: int | None = None
        self._watched = True
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def type(self, text: str) -> None:
        os.write(self._master, text.encode())

    def hold(self, key: str, seconds: float) -> None:
        """As a keyboard does: once, and after the delay again and again."""
        end = time.monotonic() + seconds
        self.type(key)
        time.sleep(min(0.3, seconds))
        while time.monotonic() < end:
            self.type(key)
            time.sleep(0.03)

    def settings(self) -> list[Any]:
        return termios.tcgetattr(self._master)

    def signal(self, number: signal.Signals) -> None:
        os.kill(self.pid, number)

    def hang_up(self) -> None:
        """The window is closed, the connection lost."""
        self._watched = False
        self._reader.join()  # a read that waits would keep the terminal alive
        os.close(self._master)

    def wait(self) -> int:
        """The exit status."""

        def ended() -> bool:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self.status = os.waitstatus_to_exitcode(status)
            return bool(pid)

        if self.status is None:
            wait_for(ended)
        assert self.status is not None
        return self.status

    def end(self) -> None:
        if self.status is None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, signal.SIGKILL)
            self.wait()
        if self._watched:
            self.hang_up()

    def _read(self) -> None:
        with contextlib.suppress(OSError):  # the program has ended
            while self._watched:
                if select.select([self._master], [], [], 0.02)[0]:
                    self.screen += os.read(self._master, 4096)


@contextmanager
def a_world(folder: Path, node: str = "/joystick", **params: Any) -> Iterator[World]:
    world = World(folder, node, **params)
    try:
        yield world
    finally:
        world.close()


@contextmanager
def joystick_program(world: World) -> Iterator[subprocess.Popen[bytes]]:
    with world.log.open("w") as log:
        process = subprocess.Popen(world.command("teleop_joy.py"), stderr=log, env=world.environment)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


@contextmanager
def keyboard_program(world: World) -> Iterator[Keyboard]:
    keyboard = Keyboard(world)
    try:
        wait_for(lambda: b"m/s" in keyboard.screen or keyboard.status is not None)
        yield keyboard
    finally:
        keyboard.end()
