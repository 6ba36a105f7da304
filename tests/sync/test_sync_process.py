"""The static multimaster as a process: what systemd and people see of it, and how it ends."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import subprocess
import sys
import time
import xmlrpc.client
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from masters import Rosmaster, served
from swarm_agent.verbs import probe_ros

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "templates/sync/static_sync.py"
KIND = "std_msgs/String"
DRIVER = "http://127.0.0.2:4711/"


class Running:
    """The process, on islands a (its own) and b; with a socket that stands for systemd."""

    def __init__(self, folder: Path, own: str, peer: str, **more: Any) -> None:
        self.notes = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.notes.bind(str(folder / "notify"))
        self.notes.settimeout(20.0)
        peers = [
            {
                "island": "b",
                "master": peer,
                "hosts": ["127.0.0.2"],
                "hears": [{"topic": "/b/odom", "type": KIND}],
            }
        ]
        times = {"poll_hz": 5.0, "silent_after": 1.0, "remove_after": 30.0}
        me = {"island": "a", "node": "/multimaster_a", "master": own, "address": "127.0.0.1"}
        self.config = folder / "multimaster.yaml"
        self.config.write_text(yaml.safe_dump({**me, **times, "peers": peers, **more}))
        environment = {**os.environ, "PYTHONPATH": str(ROOT / "templates/shared"), "WATCHDOG_USEC": "600000",
                       "NOTIFY_SOCKET": str(folder / "notify"), "PYTHONDONTWRITEBYTECODE": "1"}  # fmt: skip
        argv = (sys.executable, str(SCRIPT), "--config", str(self.config))
        self.process = subprocess.Popen(argv, env=environment, stderr=subprocess.PIPE, text=True)

    def told(self, what: str) -> None:
        """Until systemd is told ``what``."""
        while not self.notes.recv(4096).decode().startswith(what):
            pass

    def end(self, number: signal.Signals) -> float:
        start = time.monotonic()
        self.process.send_signal(number)
        self.process.wait(30)
        return time.monotonic() - start


@pytest.fixture
def own() -> Rosmaster:
    return Rosmaster()


@pytest.fixture
def peer() -> Rosmaster:
    master = Rosmaster()
    master.registerPublisher("/b/driver", "/b/odom", KIND, DRIVER)
    return master


@pytest.fixture
def running(tmp_path: Path, own: Rosmaster, peer: Rosmaster) -> Iterator[Running]:
    with served(own) as here, served(peer, "127.0.0.2") as there:
        one = Running(tmp_path, here, there)
        until(lambda: ("/b/odom", "/b/driver", DRIVER) in own.publishers())
        yield one
        if one.process.poll() is None:
            one.process.kill()
        one.process.communicate()


def until(condition: Callable[[], bool], seconds: float = 20.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_systemd_hears_that_it_is_ready_how_it_is_and_that_it_lives(running: Running) -> None:
    running.told("READY=1")
    running.told("STATUS=1 of 1 peers connected")
    running.told("WATCHDOG=1")
    running.end(signal.SIGTERM)
    running.told("STOPPING=1")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_it_ends_with_nothing_left_behind(
    running: Running, own: Rosmaster, peer: Rosmaster, number: signal.Signals
) -> None:
    until(lambda: bool(peer.subscribers()))
    assert running.end(number) < 10.0
    assert running.process.returncode == 0
    assert own.publishers() == set()
    assert own.parameters == {}
    assert peer.subscribers() == set()


def test_a_master_that_hangs_does_not_keep_it_from_ending(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as here, socket.create_server(("127.0.0.2", 0)) as there:
        one = Running(tmp_path, *(f"http://{s.getsockname()[0]}:{s.getsockname()[1]}" for s in (here, there)))
        one.told("READY=1")
        assert one.end(signal.SIGTERM) < 10.0
        assert one.process.returncode == 0


def test_a_master_that_tells_of_a_change_is_asked_at_once(
    tmp_path: Path, own: Rosmaster, peer: Rosmaster
) -> None:
    with served(own) as here, served(peer, "127.0.0.2") as there:
        one = Running(tmp_path, here, there, poll_hz=0.1, silent_after=60.0, remove_after=60.0)
        until(lambda: bool(peer.subscribers()) and bool(own.publishers()))
        time.sleep(0.3)
        peer.registerPublisher("/b/other", "/b/odom", KIND, "http://127.0.0.2:4712/")
        (_, _, slave), *_ = peer.subscribers()
        xmlrpc.client.ServerProxy(slave).publisherUpdate("/master", "/b/odom", [])
        until(lambda: any(node == "/b/other" for _, node, _ in own.publishers()), 5.0)
        one.end(signal.SIGTERM)


def test_it_takes_leave_of_a_master_that_it_has_no_more_business_with(tmp_path: Path, own: Rosmaster) -> None:
    former, peer = Rosmaster(), Rosmaster()
    with served(own) as here, served(former, "127.0.0.2") as there, served(peer, "127.0.0.2") as elsewhere:
        before = Running(tmp_path, here, there)
        until(lambda: bool(former.subscribers()))
        until(lambda: bool(own.parameters))
        before.end(signal.SIGKILL)
        (tmp_path / "again").mkdir()
        after = Running(tmp_path / "again", here, elsewhere)
        until(lambda: not former.subscribers() and bool(peer.subscribers()))
        after.end(signal.SIGTERM)


def test_no_peer_can_end_it(running: Running, own: Rosmaster) -> None:
    slave = xmlrpc.client.ServerProxy(own.nodes["/multimaster_a"].uri)
    assert slave.shutdown("/master", "go away") == [1, "", 0]
    time.sleep(0.3)
    assert slave.getPid("/x")[2] == running.process.pid


def test_its_diagnostics_are_what_ros_reads(running: Running, own: Rosmaster) -> None:
    async def heard() -> bytes:
        flow = probe_ros.Flow(2.5)
        await probe_ros.listen(own.nodes["/multimaster_a"].uri, "/diagnostics", flow, keep_first=True)
        assert flow.type == "diagnostic_msgs/DiagnosticArray"
        assert flow.count >= 2
        return flow.first_body

    (status,) = probe_ros.diagnostics_in(asyncio.run(heard()))
    assert (status["level"], status["name"]) == (0, "a: multimaster")
    assert status["message"] == "1 of 1 peers connected"
    assert status["values"]["b"] == "connected"
    assert status["values"]["b hears"] == "/b/odom 1"


def test_a_wrong_parameter_file_is_told_in_one_line(tmp_path: Path) -> None:
    one = Running(tmp_path, "http://127.0.0.1:1", "http://127.0.0.1:1")
    _, said = one.process.communicate(timeout=30)
    assert one.process.returncode == 1
    assert said == f"{one.config}: two islands have the same master: http://127.0.0.1:1\n"
