"""What docs/dead-man.md promises, without a lab: a driver's process ends in every way, its robot stands."""

from __future__ import annotations

import os
import signal
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from tests.packages.driver.driver_process import PYTHONPATH, Node, Wiring, running, wired
from tests.packages.driver.fakes import TYPES
from tests.timing import PATIENCE, RunQueue, at_most, wait_for

SPEED = 0.1  # m/s
WATCHDOG = 1.0  # s, as in the driver's unit
RAISE_IN_LOOP = Path(__file__).with_name("raise_in_loop.py")
START = 1.0  # s; what stops the robot is a program that has to start


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
        beat = time.monotonic()
        patience = beat + PATIENCE
        while node.process.poll() is None:
            if b"WATCHDOG=1" in self._received():
                beat = time.monotonic()
            assert time.monotonic() < patience, "the driver goes on"
            if time.monotonic() - beat > WATCHDOG:
                node.process.send_signal(signal.SIGABRT)
                node.process.send_signal(signal.SIGCONT)
                node.process.wait(PATIENCE)
        wiring.stop_motors()

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


def signalled(number: int) -> Callable[[Node], None]:
    return lambda node: node.process.send_signal(number)


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


@pytest.mark.parametrize("type_name", TYPES)
@pytest.mark.parametrize(
    ("fault", "bound"),
    [
        pytest.param(signalled(signal.SIGKILL), 0.3, id="killed"),
        pytest.param(signalled(signal.SIGSTOP), WATCHDOG + 0.3, id="hung"),
        pytest.param(signalled(signal.SIGUSR1), 0.1, id="exception"),
        pytest.param(signalled(signal.SIGTERM), 0.1, id="stopped"),
    ],
)
def test_however_a_driver_ends_its_robot_stands(
    type_name: str, fault: Callable[[Node], None], bound: float, tmp_path: Path
) -> None:
    with driving(type_name, tmp_path) as (node, wiring, systemd):
        queue = RunQueue(node.process.pid)
        way, moment = wiring.pty.snapshot().distance, time.monotonic()
        fault(node)
        systemd.look_after(node, wiring)
        assert not wiring.moving()
        late = queue.lost()
        assert wiring.pty.snapshot().distance - way <= SPEED * (bound + at_most(START) + late)
        assert time.monotonic() - moment <= bound + at_most(2 * START) + late


def test_a_driver_that_hung_reports_where(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with driving("koala", tmp_path) as (node, wiring, systemd):
        os.kill(node.process.pid, signal.SIGSTOP)
        systemd.look_after(node, wiring)
    output = capfd.readouterr().err
    assert "Fatal Python error: Aborted" in output
    assert "driver.py" in output
