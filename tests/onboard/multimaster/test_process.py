"""The static multimaster as a process: its notifications, its diagnostics and how it ends."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import subprocess
import sys
import time
import xmlrpc.client
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from swarm_onboard.ros1_probe import client

from swarmctl.resources import onboard
from tests.onboard.multimaster.masters import Rosmaster, served
from tests.timing import PATIENCE, wait_for

SCRIPT = onboard() / "nodes/multimaster/static_multimaster.py"
KIND = "std_msgs/String"
DRIVER = "http://127.0.0.2:4711/"


class Running:
    """The process, on islands a (its own) and b; with a socket in place of systemd's."""

    def __init__(self, folder: Path, own: str, peer: str, **more: Any) -> None:
        self.notes = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.notes.bind(str(folder / "notify"))
        self.notes.settimeout(PATIENCE)
        peers = [
            {
                "island": "b",
                "master": peer,
                "hosts": ["127.0.0.2"],
                "receives": [{"topic": "/b/odom", "type": KIND}],
            }
        ]
        times = {"poll_hz": 5.0, "silent_after": 1.0, "remove_after": 30.0}
        me = {"island": "a", "node": "/multimaster_a", "master": own, "address": "127.0.0.1"}
        self.config = folder / "multimaster.yaml"
        self.config.write_text(yaml.safe_dump({**me, **times, "peers": peers, **more}))
        environment = {**os.environ, "PYTHONPATH": str(onboard().parent), "WATCHDOG_USEC": "600000",
                       "NOTIFY_SOCKET": str(folder / "notify"), "PYTHONDONTWRITEBYTECODE": "1"}  # fmt: skip
        argv = (sys.executable, str(SCRIPT), "--config", str(self.config))
        self.process = subprocess.Popen(argv, env=environment, stderr=subprocess.PIPE, text=True)

    def wait_for_note(self, start: str) -> None:
        """Wait for a notification to systemd that begins with ``start``."""
        while not self.notes.recv(4096).decode().startswith(start):
            pass

    def end(self, number: signal.Signals) -> int:
        """Send the signal; return the exit status."""
        self.process.send_signal(number)
        return self.process.wait(PATIENCE)


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
        wait_for(lambda: ("/b/odom", "/b/driver", DRIVER) in own.publishers())
        yield one
        if one.process.poll() is None:
            one.process.kill()
        one.process.communicate()


def test_systemd_is_notified_of_readiness_status_and_watchdog(running: Running) -> None:
    running.wait_for_note("READY=1")
    running.wait_for_note("STATUS=1 of 1 peers connected")
    running.wait_for_note("WATCHDOG=1")
    running.end(signal.SIGTERM)
    running.wait_for_note("STOPPING=1")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_it_unregisters_everything_when_it_ends(
    running: Running, own: Rosmaster, peer: Rosmaster, number: signal.Signals
) -> None:
    wait_for(lambda: bool(peer.subscribers()))
    assert running.end(number) == 0
    assert own.publishers() == set()
    assert own.parameters == {}
    assert peer.subscribers() == set()


def test_it_ends_although_a_master_hangs(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as here, socket.create_server(("127.0.0.2", 0)) as there:
        one = Running(tmp_path, *(f"http://{s.getsockname()[0]}:{s.getsockname()[1]}" for s in (here, there)))
        one.wait_for_note("READY=1")
        assert one.end(signal.SIGTERM) == 0


def test_a_publisher_update_triggers_a_poll_at_once(tmp_path: Path, own: Rosmaster, peer: Rosmaster) -> None:
    with served(own) as here, served(peer, "127.0.0.2") as there:
        one = Running(tmp_path, here, there, poll_hz=0.1, silent_after=60.0, remove_after=60.0)
        wait_for(lambda: bool(peer.subscribers()) and bool(own.publishers()))
        time.sleep(0.3)
        peer.registerPublisher("/b/other", "/b/odom", KIND, "http://127.0.0.2:4712/")
        (_, _, slave), *_ = peer.subscribers()
        xmlrpc.client.ServerProxy(slave).publisherUpdate("/master", "/b/odom", [])
        wait_for(lambda: any(node == "/b/other" for _, node, _ in own.publishers()))
        one.end(signal.SIGTERM)


def test_it_unregisters_at_a_master_that_is_no_longer_configured(tmp_path: Path, own: Rosmaster) -> None:
    former, peer = Rosmaster(), Rosmaster()
    with served(own) as here, served(former, "127.0.0.2") as there, served(peer, "127.0.0.2") as elsewhere:
        before = Running(tmp_path, here, there)
        wait_for(lambda: bool(former.subscribers()))
        wait_for(lambda: bool(own.parameters))
        before.end(signal.SIGKILL)
        (tmp_path / "again").mkdir()
        after = Running(tmp_path / "again", here, elsewhere)
        wait_for(lambda: not former.subscribers() and bool(peer.subscribers()))
        after.end(signal.SIGTERM)


def test_no_peer_can_shut_it_down(running: Running, own: Rosmaster) -> None:
    slave = xmlrpc.client.ServerProxy(own.nodes["/multimaster_a"].uri)
    assert slave.shutdown("/master", "go away") == [1, "", 0]
    time.sleep(0.3)
    assert slave.getPid("/x")[2] == running.process.pid


def test_its_diagnostics_are_ros_messages(running: Running, own: Rosmaster) -> None:
    async def received() -> bytes:
        flow = client.Flow(2.5)
        await client.listen(own.nodes["/multimaster_a"].uri, "/diagnostics", flow, keep_first=True)
        assert flow.type == "diagnostic_msgs/DiagnosticArray"
        assert flow.count >= 2
        return flow.first_body

    (status,) = client.diagnostics_in(asyncio.run(received()))
    assert (status.level, status.name) == (0, "a: multimaster")
    assert status.message == "1 of 1 peers connected"
    assert status.values["b"] == "connected"
    assert status.values["b topics received"] == "/b/odom 1"


def test_a_wrong_parameter_file_is_reported_in_one_line(tmp_path: Path) -> None:
    one = Running(tmp_path, "http://127.0.0.1:1", "http://127.0.0.1:1")
    _, printed = one.process.communicate(timeout=PATIENCE)
    assert one.process.returncode == 1
    assert printed == f"{one.config}: two islands have the same master: http://127.0.0.1:1\n"
