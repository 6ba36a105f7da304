"""A driver node as a process of its own: fake ROS at one end, an emulated robot on a pty at the other."""

from __future__ import annotations

import itertools
import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from socketserver import ThreadingMixIn
from typing import Any
from xmlrpc.server import SimpleXMLRPCServer

import yaml

from swarmctl.lab.emulators import emulator
from swarmctl.lab.emulators.emulator_lookup import EMULATED_AS
from swarmctl.lab.emulators.robot import Robot
from swarmctl.lab.emulators.serial_robot import Port as Pty
from swarmctl.resources import onboard
from tests.onboard.driver.fakes import params_for
from tests.timing import PATIENCE, wait_for

DRIVERS = onboard() / "nodes/drivers"
FAKE_ROS = Path(__file__).parent / "fake_ros"
NO_MASTER = "http://127.0.0.1:9/"  # where none answers


class Wiring:
    """An emulated robot behind a stable device name, as udev gives it, and its driver's parameter file."""

    def __init__(self, type_name: str, folder: Path, *, robot: Robot | None = None, **settings: Any) -> None:
        self.pty = Pty(robot or emulator(EMULATED_AS.get(type_name, type_name)))
        self.device = folder / "device"
        self.config = folder / "params.yaml"
        self.config.write_text(yaml.safe_dump(params_for(type_name, str(self.device), **settings)))

    def plug(self) -> None:
        slave = self.pty.plug()
        self.device.unlink(missing_ok=True)
        self.device.symlink_to(slave)

    def unplug(self) -> None:
        self.device.unlink()
        self.pty.unplug()

    def moving(self) -> bool:
        state = self.pty.snapshot()
        return bool(state.left or state.right)

    def stop_motors(self) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, str(DRIVERS / "stop_motors.py"), "--config", str(self.config)]
        return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)


PYTHONPATH = f"{FAKE_ROS}:{onboard().parent}"


class Node:
    """A running serial_driver.py, or another ``script``. ``published`` is what it published, in order."""

    def __init__(self, config: Path, script: Path = DRIVERS / "serial_driver.py", **environment: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, str(script), "--config", str(config), "__name:=driver"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={
                **os.environ,
                "PYTHONPATH": PYTHONPATH,
                "ROS_MASTER_URI": NO_MASTER,
                **environment,
            },
        )
        self.published: list[dict[str, Any]] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def command(
        self, linear: float, angular: float = 0.0, sender: str = "/tester", stamp: float | None = None
    ) -> None:
        """``stamp``: of a TwistStamped, s; None for a Twist."""
        stamped = "" if stamp is None else f" {stamp}"
        self.process.stdin.write(f"{sender} {linear} {angular}{stamped}\n")
        self.process.stdin.flush()

    def suffer(self, act: str) -> None:
        """``shutdown``: a master wants it to end, or anybody; ``failure``: ROS fails in its process."""
        self.process.stdin.write(f"{act}\n")
        self.process.stdin.flush()

    def set(self, actuator: str, *values: int, sender: str = "/tester") -> None:
        self.process.stdin.write(f"{sender} {actuator}={','.join(map(str, values))}\n")
        self.process.stdin.flush()

    def publish(self, topic: str, message: bytes) -> None:
        """Makes another node publish a message of any type."""
        self.process.stdin.write(f"{topic}:{message.hex()}\n")
        self.process.stdin.flush()

    def drive(self, seconds: float, linear: float, angular: float = 0.0, sender: str = "/tester") -> None:
        """Command again and again, at 20 Hz."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.command(linear, angular, sender)
            time.sleep(0.05)

    def drive_until(self, what: Callable[[], bool], linear: float, angular: float = 0.0) -> None:
        """Command at 20 Hz until ``what`` is true."""
        wait_for(lambda: self.command(linear, angular) or what(), interval=0.05)

    def latest(self, topic: str) -> dict[str, Any] | None:
        return next((message for message in reversed(self.published) if message["topic"] == topic), None)

    def status(self) -> dict[str, Any]:
        message = self.latest("/diagnostics")
        return message["status"][0] if message else {"level": None, "message": ""}

    def values(self) -> dict[str, str]:
        """The figures of the latest status."""
        return {value["key"]: value["value"] for value in self.status()["values"]}

    def wait_until_ready(self) -> None:
        wait_for(lambda: self.latest("listening") and self.latest("odom"))

    def end(self) -> None:
        self.process.kill()
        self.process.wait()
        self._reader.join()
        self.process.stdin.close()
        self.process.stdout.close()

    def _read(self) -> None:
        for line in self.process.stdout:
            self.published.append(json.loads(line))


class _Server(ThreadingMixIn, SimpleXMLRPCServer):
    daemon_threads = True


@contextmanager
def master(nodes: Mapping[str, str]) -> Iterator[str]:
    """A ROS master that knows where ``nodes`` are; its URI.

    Each look at its process finds another one.
    """
    processes = itertools.count(1)

    def lookup(_caller: str, node: str) -> list[Any]:
        return [1, "", nodes[node]] if node in nodes else [-1, "unknown node", ""]

    with _Server(("127.0.0.1", 0), logRequests=False) as server:
        server.register_function(lookup, "lookupNode")
        server.register_function(lambda _caller: [1, "", next(processes)], "getPid")
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_address[1]}/"
        finally:
            server.shutdown()
            thread.join()


class _WebPage(BaseHTTPRequestHandler):
    def do_POST(self) -> None:
        self.send_response(200)
        self.end_headers()
        self.wfile.write(b"<html>It works!")

    def log_message(self, *_: Any) -> None:
        pass


@contextmanager
def no_master() -> Iterator[str]:
    """A web server at the place of a master; its URI."""
    with ThreadingHTTPServer(("127.0.0.1", 0), _WebPage) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_address[1]}/"
        finally:
            server.shutdown()
            thread.join()


@contextmanager
def wired(type_name: str, folder: Path, **settings: Any) -> Iterator[Wiring]:
    wiring = Wiring(type_name, folder, **settings)
    wiring.plug()
    try:
        yield wiring
    finally:
        wiring.pty.close()


@contextmanager
def running(config: Path, *script: Path, **environment: str) -> Iterator[Node]:
    node = Node(config, *script, **environment)
    try:
        yield node
    finally:
        node.end()
