"""Pairing with a PIN, tried with stand-ins for bluetoothctl and busctl: no adapter is at hand."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests import ROOT
from tests.timing import PATIENCE

SCRIPT = ROOT / "templates/os/bluetooth-pair"
ROBOT, PIN = "10:00:E8:C5:64:37", "4971"
# The robot is `on`, is `known` once it was seen, and is `paired` after the right PIN.
BUSCTL = r"""#!/bin/sh
cd "$WORLD"; echo "busctl $*" >> argv
case "$*" in
*Adapter1\ Address) echo 's "00:11:22:33:44:55"' ;;
*Device1\ Paired) [ -e known ] || exit 1; [ -e paired ] && echo "b true" || echo "b false" ;;
*Trusted*) : > trusted ;;
esac
"""
BLUETOOTHCTL = r"""#!/bin/sh
cd "$WORLD"; echo "bluetoothctl $*" >> argv
echo "Agent registered"
while read -r verb rest; do
  echo "$verb $rest" >> commands
  case $verb in
  select|power) echo "Changing $verb succeeded" ;;
  default-agent) echo "Default agent request successful" ;;
  scan) [ "$rest" = on ] && [ -e on ] && { : > known; echo "[NEW] Device 10:00:E8:C5:64:37 e-puck"; } ;;
  pair)
    printf '[agent] Enter PIN code: '; read -r pin
    if [ "$pin" = 4971 ]; then : > paired; echo "Pairing successful"
    else echo "Failed to pair: org.bluez.Error.AuthenticationFailed"; fi ;;
  esac
done
"""


class World:
    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for name, text in (("busctl", BUSCTL), ("bluetoothctl", BLUETOOTHCTL)):
            (folder / "bin").mkdir(exist_ok=True)
            (folder / "bin" / name).write_text(text)
            (folder / "bin" / name).chmod(0o755)
        (folder / "radios").mkdir()
        (folder / "pin").write_text(PIN)

    def begin(self) -> subprocess.Popen[str]:
        environment = {
            "PATH": f"{self.folder}/bin:{os.environ['PATH']}",
            "WORLD": str(self.folder),
            "SWARM_RADIOS": str(self.folder / "radios"),
        }
        arguments = ["--adapter", "hci0", "--robot", ROBOT.lower(), "--pin-file", str(self.folder / "pin")]
        return subprocess.Popen(
            [sys.executable, SCRIPT, *arguments], env=environment,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip

    def run(self) -> tuple[int, str]:
        with self.begin() as process:
            output, _ = process.communicate(timeout=PATIENCE)
            return process.returncode, output

    def has(self, name: str) -> bool:
        return (self.folder / name).exists()


@pytest.fixture
def world(tmp_path: Path) -> World:
    return World(tmp_path)


def test_a_robot_is_found_paired_and_trusted(world: World) -> None:
    (world.folder / "on").touch()
    status, output = world.run()
    assert status == 0
    assert f"{ROBOT} is paired" in output
    assert world.has("paired")
    assert world.has("trusted")
    assert PIN not in output
    assert PIN not in (world.folder / "argv").read_text()
    assert "select 00:11:22:33:44:55" in (world.folder / "commands").read_text()


def test_a_robot_that_is_paired_already_is_left_alone(world: World) -> None:
    (world.folder / "known").touch()
    (world.folder / "paired").touch()
    assert world.run()[0] == 0
    assert not world.has("commands")
    assert world.has("trusted")


def test_a_wrong_pin_is_reported_without_it_and_tried_again(world: World) -> None:
    (world.folder / "on").touch()
    (world.folder / "pin").write_text("0000")
    with world.begin() as process:
        assert process.stdout is not None
        output = process.stdout.readline()
        process.kill()
    assert "AuthenticationFailed: check the PIN" in output
    assert "again in" in output
    assert "0000" not in output


def test_it_waits_while_another_robot_is_being_connected(world: World) -> None:
    (world.folder / "on").touch()
    busy = os.open(world.folder / "radios", os.O_RDONLY)
    fcntl.flock(busy, fcntl.LOCK_EX)
    with world.begin() as process:
        time.sleep(0.7)
        assert process.poll() is None
        assert not world.has("argv")
        os.close(busy)
        process.communicate(timeout=PATIENCE)
        assert process.returncode == 0
