"""What docs/dead-man.md promises, without a lab: a driver's process ends in every way, its robot stands."""

from __future__ import annotations

import os
import signal
import socket
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from tests.onboard.driver.driver_process import PYTHONPATH, Node, Wiring, running, wired
from tests.onboard.driver.fakes import TYPES
from tests.timing import PATIENCE, Promise, wait_for, withheld

SPEED = 0.1  # m/s
WATCHDOG = 1.0  # s, as in the driver's unit
RAISE_IN_LOOP = Path(__file__).with_name("raise_in_loop.py")
FAULTS = {  # the signal that makes it, and until when the robot stands by docs/dead-man.md, s
    "killed": (signal.SIGKILL, 1.0),
    "hung": (signal.SIGSTOP, 2.3),
    "with an exception": (signal.SIGUSR1, 0.8),
    "stopped": (signal.SIGTERM, 0.5),
}


class Systemd:
    """As much of systemd as a driver's unit has of it: a watchdog, and what runs after the driver."""

    def __init__(self, folder: Path) -> None:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(str(folder / "notify"))
        self._socket.settimeout(0.01)
        self.environment = {
            "NOTIFY_SOCKET": str(folder / "notify"),
            "WATCHDOG_USEC": str(round(WATCHDOG * 1e6)),
        }

    def look_after(self, node: Node, wiring: Wiring) -> None:
        """Until the driver has ended, or has to be ended; then stop its robot."""
        self._beat = time.monotonic()
        wait_for(lambda: self._is_over(node), complaint="the driver goes on", interval=0.0)
        wiring.stop_motors()

    def _is_over(self, node: Node) -> bool:
        """Whether the driver has ended; one whose watchdog is late is ended."""
        if b"WATCHDOG=1" in self._received():
            self._beat = time.monotonic()
        if node.process.poll() is None and time.monotonic() - self._beat > WATCHDOG:
            node.process.send_signal(signal.SIGABRT)
            node.process.send_signal(signal.SIGCONT)
            node.process.wait(PATIENCE)
        return node.process.poll() is not None

    def forget(self) -> None:
        while self._received():
            pass

    def close(self) -> None:
        self._socket.close()

    def _received(self) -> bytes:
        try:
            return self._socket.recv(4096)
        except TimeoutError:
            return b""


def raising(folder: Path) -> dict[str, str]:
    """The environment in which SIGUSR1 raises an exception in the driver's loop."""
    (folder / "sitecustomize.py").write_text(RAISE_IN_LOOP.read_text())
    return {"PYTHONPATH": f"{PYTHONPATH}:{folder}"}


@contextmanager
def driving(type_name: str, folder: Path) -> Iterator[tuple[Node, Wiring, Systemd]]:
    """A driver under systemd, whose robot drives on for a while even without new commands."""
    with (
        closing(Systemd(folder)) as systemd,
        wired(type_name, folder, command_timeout=2.0) as wiring,
        running(wiring.config, **systemd.environment, **raising(folder)) as node,
    ):
        node.wait_until_ready()
        node.drive(0.3, SPEED)
        wait_for(wiring.moving)
        systemd.forget()
        yield node, wiring, systemd


@pytest.mark.parametrize(
    "type_name", [TYPES[0], *(pytest.param(one, marks=pytest.mark.slow) for one in TYPES[1:])]
)
@pytest.mark.parametrize("fault", FAULTS)
def test_however_a_driver_ends_its_robot_stands(
    type_name: str, fault: str, tmp_path: Path, promise: Promise
) -> None:
    """The bars are those of the page; how long it drives on is what it drives, by its speed."""
    with driving(type_name, tmp_path) as (node, wiring, systemd):
        number, bar = FAULTS[fault]
        lost, way = withheld(), wiring.pty.snapshot().distance
        node.process.send_signal(number)
        systemd.look_after(node, wiring)
        assert not wiring.moving()
        drove = (wiring.pty.snapshot().distance - way) / SPEED
        promise(f"driver {fault}, until the {type_name} stands", drove - (withheld() - lost), bar)


def test_a_driver_that_hung_reports_where(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with driving("koala", tmp_path) as (node, wiring, systemd):
        os.kill(node.process.pid, signal.SIGSTOP)
        systemd.look_after(node, wiring)
    output = capfd.readouterr().err
    assert "Fatal Python error: Aborted" in output
    assert "driver.py" in output
