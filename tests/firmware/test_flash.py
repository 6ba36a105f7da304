"""A firmware's way onto a board: the real agent and avrdude, the boot loader of a simulated board."""

from __future__ import annotations

import shutil
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest
import serial

from swarmctl.deploy.flash import Flashed, Job, flash
from swarmctl.deploy.flash import result_of as outcome
from swarmctl.firmware import avrdude
from swarmctl.firmware.compiler import Built
from swarmctl.lab.emulators.arduino_rover import SimulatedBoard
from swarmctl.lab.emulators.bootloader import PAGE
from swarmctl.lab.emulators.serial_robot import Port
from swarmctl.lab.emulators.uno import image
from swarmctl.remote.parallel_hosts import Finished
from swarmctl.remote.transport import HostError, Kind, Session, Target
from swarmctl.render.sketch import FirmwareSettings, sketch
from tests.onboard.agent.fakehost import FakeHost
from tests.onboard.agent.local_session import LocalSession
from tests.timing import PATIENCE

UNIT = "swarm-new.rover.service"
JOURNALCTL = (
    '#!/bin/sh\n[ -e $SWARM_PREFIX/board-reports ] && echo "swarmctl firmware 0123456789ab"\nexit 0\n'
)
SLOWER = FirmwareSettings(wheel_speed_max=0.3)
STANDS_STILL = b"\xff\xcf"  # `rjmp` to itself, where the processor starts
needs_avrdude = pytest.mark.skipif(not shutil.which("avrdude"), reason="avrdude is missing")

Flash = Callable[..., Flashed | HostError]


class Folders:
    """Leads to hosts in folders, whose programs are those of this machine but systemd's."""

    def __init__(self, hosts: Mapping[str, FakeHost]) -> None:
        self._hosts = hosts

    @contextmanager
    def connect(self, target: Target) -> Iterator[Session]:
        if target.host not in self._hosts:
            raise HostError(Kind.UNREACHABLE, f"{target.host}: no route to host")
        yield LocalSession(self._hosts[target.host].environment())


def flashed(jobs: list[Job], hosts: Mapping[str, FakeHost]) -> dict[str, Flashed | HostError]:
    """What became of each robot's board."""
    targets = {job.host: Target(job.host, job.host, "robot") for job in jobs}
    events = list(flash(jobs, targets, Folders(hosts), parallel=4))
    found = {event.host: event.outcome for event in events if isinstance(event, Finished)}
    return {job.robot: outcome(job, found[job.host]) for job in jobs}


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


@pytest.fixture(scope="module")
def slower(build_firmware: Callable[[FirmwareSettings], Built]) -> Path:
    return build_firmware(SLOWER).hex


@pytest.fixture
def write(host: FakeHost, slower: Path) -> Flash:
    """Write the firmware of a slower robot through a port that the host has."""

    def written(port: Path) -> Flashed | HostError:
        there = on(host, port)
        there.parent.mkdir(parents=True, exist_ok=True)
        there.touch()
        writing = avrdude.writing("rover", slower.read_bytes(), str(port), "arduino", 115_200)
        return flashed([job(str(port), writing)], {"pi": host})["rover"]

    return written


def job(port: str, writing: avrdude.Writing, robot: str = "rover", host: str = "pi") -> Job:
    return Job("new", robot, host, UNIT, port, "0123456789ab", writing)


def on(host: FakeHost, path: Path | str) -> Path:
    return host.prefix / str(path).lstrip("/")


@pytest.fixture
def board(boards: Callable[..., SimulatedBoard]) -> Iterator[Port]:
    """An UNO with the default firmware, at its cable."""
    with Port(boards()) as port:
        yield port


def path_of(board: Port) -> Path:
    assert board.path is not None
    return board.path


def holds(board: Port) -> bytes:
    assert isinstance(board.robot, SimulatedBoard)
    return bytes(board.robot.bootloader.memory)


def output_of(board: Port, seconds: float = PATIENCE) -> bytes:
    """What a driver receives that opens the port."""
    received, end = b"", time.monotonic() + seconds
    with serial.Serial(str(board.path), 57600, timeout=0.05) as line:
        while b"swarmctl firmware " not in received[:-12] and time.monotonic() < end:
            received += line.read(64)
    return received


@needs_avrdude
def test_the_board_holds_it_and_runs_it_and_the_driver_runs_again(
    host: FakeHost, board: Port, write: Flash, slower: Path
) -> None:
    (host.prefix / "board-reports").touch()
    assert write(path_of(board)) == Flashed(runs=True, reported=True)
    program = image(slower)
    assert holds(board)[: len(program)] == program
    assert sketch("rover", SLOWER).digest.encode() in output_of(board)
    verbs = [call.split()[0] for call in host.calls()]
    assert verbs == ["stop", "reset-failed", "start"], "the driver stands aside, and is back"
    assert not on(host, "/opt/swarm/new/state/firmware").exists()


@needs_avrdude
def test_a_board_with_failed_write_does_not_start_it_until_reflashed(
    host: FakeHost, board: Port, write: Flash, slower: Path
) -> None:
    (host.prefix / "board-reports").touch()
    assert isinstance(board.robot, SimulatedBoard)
    pairs = enumerate(zip(holds(board), image(slower), strict=False))
    board.robot.bootloader.worn = next(at for at, (old, new) in pairs if at >= PAGE and old != new)
    result = write(path_of(board))
    assert isinstance(result, HostError)
    assert result.message == "what the board holds now is not what was written to it"
    assert "stands still until it is flashed again" in result.hint
    assert (host.prefix / "units" / UNIT).exists(), "the driver runs again"
    assert holds(board).startswith(STANDS_STILL)
    assert output_of(board, 2.0) == b""
    board.robot.bootloader.worn = None
    assert write(path_of(board)) == Flashed(runs=True, reported=True)
    assert sketch("rover", SLOWER).digest.encode() in output_of(board)


@needs_avrdude
def test_a_cable_that_is_disconnected_meanwhile_is_an_error(
    host: FakeHost, board: Port, write: Flash
) -> None:
    """avrdude itself would read for ever."""
    path = path_of(board)

    def pull() -> None:
        while not holds(board).startswith(STANDS_STILL):
            time.sleep(0.01)
        board.unplug()
        on(host, path).unlink()

    hand = threading.Thread(target=pull)
    hand.start()
    result = write(path)
    hand.join()
    assert isinstance(result, HostError)
    assert result.message == f"{path} vanished while the board was written"
    assert (host.prefix / "units" / UNIT).exists(), "the driver runs again"
    assert holds(board).startswith(STANDS_STILL)


def test_a_driver_that_does_not_run_is_left_alone(host: FakeHost, write: Flash) -> None:
    (host.prefix / "units" / UNIT).unlink()
    stand_in(host, "exit 0")
    assert write(Path("/dev/x")) == Flashed(runs=False, reported=False)
    assert host.calls() == []


def test_a_driver_that_does_not_restart_is_an_error_of_its_own(host: FakeHost, write: Flash) -> None:
    stand_in(host, "echo not in sync; exit 1")
    (host.prefix / f"broken-{UNIT}-").touch()
    result = write(Path("/dev/x"))
    assert isinstance(result, HostError)
    assert result.message.startswith("the board's boot loader does not answer on /dev/x; ")
    assert UNIT in result.message


def stand_in(host: FakeHost, script: str) -> None:
    """For avrdude."""
    program = host.prefix / "bin/avrdude"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)


@pytest.mark.parametrize(
    ("printed", "expected"),
    [
        (
            "avrdude warning: attempt 10 of 10: not in sync: resp=0x00",
            "the board's boot loader does not answer on /dev/x",
        ),
        (
            "ser_open(): cannot open device /dev/x: Device or resource busy",
            "/dev/x is in use by another program",
        ),
        ("avrdude: Device signature = 0x1e9514", "the board on /dev/x has another processor"),
        (
            "avrdude error: something new\navrdude OS error: ioctl(TIOCMGET)\navrdude done.  Thank you.",
            "avrdude failed: avrdude error: something new",
        ),
    ],
)
def test_output_of_avrdude_becomes_a_clear_message(
    host: FakeHost, write: Flash, printed: str, expected: str
) -> None:
    stand_in(host, f"echo '{printed}' >&2; exit 1")
    result = write(Path("/dev/x"))
    assert isinstance(result, HostError)
    assert result.message == expected
    assert "--speed" in result.hint
    assert (host.prefix / "units" / UNIT).exists(), "the driver runs again"


def test_without_avrdude_nothing_is_touched(host: FakeHost) -> None:
    on(host, "/dev").mkdir()
    on(host, "/dev/ttyACM0").touch()
    writing = avrdude.Writing({}, ("avrdude-of-nowhere",))
    result = flashed([job("/dev/ttyACM0", writing)], {"pi": host})["rover"]
    assert isinstance(result, HostError)
    assert (result.message, result.hint) == (
        "avrdude-of-nowhere is missing",
        "sudo apt install avrdude-of-nowhere",
    )
    assert host.calls() == []


def test_errors_of_one_cable_or_host_affect_no_other_board(
    host: FakeHost,
) -> None:
    stand_in(host, "exit 0")
    on(host, "/dev").mkdir()
    on(host, "/dev/second").touch()
    (host.prefix / "board-reports").touch()
    writing = avrdude.Writing({}, ("avrdude",))
    jobs = [
        job("/dev/swarm/rover", writing, "first"),
        job("/dev/second", writing, "second"),
        job("/dev/swarm/k3", writing, "third", host="away"),
    ]
    results = flashed(jobs, {"pi": host})
    assert results == {
        "first": HostError(
            Kind.REFUSED,
            "there is no /dev/swarm/rover",
            "is the board's cable in, and was the swarm deployed?",
        ),
        "second": Flashed(runs=True, reported=True),
        "third": HostError(Kind.UNREACHABLE, "away: no route to host"),
    }
    assert len(host.calls()) == 3, "stopped and started for the second board alone"
