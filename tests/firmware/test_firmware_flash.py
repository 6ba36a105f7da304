"""A firmware's way onto a board: the real agent, the real avrdude; host and boot loader stand in."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from bootloader import bootloader
from fakehost import FakeHost
from local_session import LocalSession

from swarmctl.deploy.flash import Flashed, Job, flash
from swarmctl.firmware.build import Built
from swarmctl.remote.transport import HostError, Session, Target

UNIT = "swarm-new.rover.service"
JOURNALCTL = '#!/bin/sh\n[ -e $SWARM_PREFIX/board-speaks ] && echo "swarmctl firmware 0123456789ab"\nexit 0\n'
needs_avrdude = pytest.mark.skipif(not shutil.which("avrdude"), reason="avrdude is missing")


class Folder:
    """Leads to a host in a folder, whose programs are those of this machine but systemd's."""

    def __init__(self, host: FakeHost) -> None:
        self._host = host

    @contextmanager
    def connect(self, target: Target) -> Iterator[Session]:
        yield LocalSession(self._host.environment())


@pytest.fixture
def host(tmp_path: Path) -> FakeHost:
    host = FakeHost(tmp_path)
    sudo = '#!/bin/sh\nshift\nexec "$@"\n'
    for name, text in (("sudo", sudo), ("journalctl", JOURNALCTL)):
        (host.prefix / "bin" / name).write_text(text)
        (host.prefix / "bin" / name).chmod(0o755)
    (host.prefix / "etc/systemd/system" / UNIT).touch()
    (host.prefix / "units" / UNIT).write_text("7 release")
    return host


@pytest.fixture
def written(host: FakeHost, firmware: Built) -> Callable[..., Flashed | HostError]:
    """Write the firmware through a port that the host has."""

    def write(port: Path, **changes: object) -> Flashed | HostError:
        there = host.prefix / str(port).lstrip("/")
        there.parent.mkdir(parents=True, exist_ok=True)
        there.touch()
        job = Job("new", UNIT, str(port), firmware.hex.read_bytes(), "0123456789ab")
        target = Target("pi", "pi", "robot")
        return flash(replace(job, **changes), target, Folder(host), lambda _: None)  # type: ignore[arg-type]

    return write


def program(firmware: Built, folder: Path) -> bytes:
    image = folder / "program.bin"
    subprocess.run(["avr-objcopy", "-I", "ihex", "-O", "binary", firmware.hex, image], check=True)
    return image.read_bytes()


@needs_avrdude
def test_the_board_holds_it_and_the_driver_runs_again(
    host: FakeHost, firmware: Built, written: Callable[..., object], tmp_path: Path
) -> None:
    (host.prefix / "board-speaks").touch()
    with bootloader() as board:
        assert written(board.port) == Flashed(told=True)
        image = program(firmware, tmp_path)
        assert board.memory[: len(image)] == image
    verbs = [call.split()[0] for call in host.calls()]
    assert verbs == ["stop", "reset-failed", "start"], "the driver stands aside, and is back"


@needs_avrdude
def test_flash_that_does_not_keep_it_is_told_and_the_driver_runs_again(
    host: FakeHost, written: Callable[..., object]
) -> None:
    with bootloader(wears=100) as board:
        result = written(board.port)
    assert isinstance(result, HostError)
    assert "not what was written" in result.message
    assert (host.prefix / "units" / UNIT).exists(), "the driver runs again"


@pytest.mark.parametrize(
    ("said", "told"),
    [
        (
            "avrdude warning: attempt 10 of 10: not in sync: resp=0x00",
            "the board's boot loader does not answer on /dev/x",
        ),
        (
            'ser_open(): can\'t open device "/dev/x": Device or resource busy',
            "/dev/x is in use by another program",
        ),
        ("avrdude: Device signature = 0x1e9514", "the board on /dev/x has another processor"),
        ("something new", "avrdude failed: something new"),
    ],
)
def test_what_avrdude_says_is_put_into_words(
    host: FakeHost, written: Callable[..., object], said: str, told: str
) -> None:
    avrdude = host.prefix / "bin/avrdude"
    avrdude.write_text(f"#!/bin/sh\necho '{said.replace(chr(39), '')}' >&2; exit 1\n")
    avrdude.chmod(0o755)
    result = written(Path("/dev/x"))
    assert isinstance(result, HostError)
    assert result.message == told
    assert "--speed" in result.hint
    assert (host.prefix / "units" / UNIT).exists(), "the driver runs again"


def test_without_avrdude_nothing_is_touched(
    host: FakeHost, written: Callable[..., object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Job, "commands", lambda self, file: [[], ["avrdude-of-nowhere"], []])
    result = written(Path("/dev/ttyACM0"))
    assert isinstance(result, HostError)
    assert (result.message, result.hint) == (
        "avrdude-of-nowhere is missing",
        "sudo apt install avrdude-of-nowhere",
    )
    assert host.calls() == []


@needs_avrdude
def test_without_a_cable_nothing_is_touched(host: FakeHost, firmware: Built) -> None:
    job = Job("new", UNIT, "/dev/swarm/rover", firmware.hex.read_bytes(), "0123456789ab")
    result = flash(job, Target("pi", "pi", "robot"), Folder(host), lambda _: None)
    assert isinstance(result, HostError)
    assert result.message == "there is no /dev/swarm/rover"
    assert host.calls() == []


def test_what_is_run_can_be_read_before() -> None:
    job = Job("new", UNIT, "/dev/swarm/rover", b"", "0123456789ab", speed=57_600)
    assert [" ".join(command) for command in job.commands("rover.hex")] == [
        f"systemctl stop {UNIT}",
        "avrdude -p atmega328p -c arduino -P /dev/swarm/rover -b 57600 -D -U flash:w:rover.hex:i",
        f"systemctl start {UNIT}",
    ]
