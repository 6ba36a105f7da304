"""``ros-client`` with masters that start, stop and restart: its program ends when its master restarts."""

from __future__ import annotations

import os
import pty
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from tests import ROOT
from tests.timing import PATIENCE, wait_for

CLIENT = ROOT / "templates/ros1/ros-client"
READY = "echo ready; while :; do sleep 0.1; done"


class Master:
    """Answers for /run_id on one port, as often as it is opened."""

    def __init__(self) -> None:
        self.run_id: str | None = "one"
        self.use_sim_time = False
        self._server: SimpleXMLRPCServer | None = None
        self.port = 0

    @property
    def uri(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def open(self) -> None:
        server = _Server(("127.0.0.1", self.port), logRequests=False)
        self.port = server.server_address[1]
        server.register_function(self._parameter, "getParam")
        threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()
        self._server = server

    def close(self) -> None:
        if self._server is not None:
            self._server.shutdown()
            self._server.server_close()
            self._server = None

    def _parameter(self, caller: str, name: str) -> list[object]:
        value = {"/run_id": self.run_id, "/use_sim_time": self.use_sim_time}.get(name)
        return [1, "", value] if value else [-1, "not set", 0]


class _Server(SimpleXMLRPCServer):
    allow_reuse_address = True


@pytest.fixture
def master() -> Iterator[Master]:
    one = Master()
    one.open()
    yield one
    one.close()


@contextmanager
def client(master: Master, *command: str, **more: object) -> Iterator[subprocess.Popen[str]]:
    running = subprocess.Popen(
        [sys.executable, str(CLIENT), *command],
        env={**os.environ, "ROS_MASTER_URI": master.uri}, text=True,
        **{"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, **more},  # type: ignore[call-overload]
    )  # fmt: skip
    try:
        yield running
    finally:
        with suppress(ProcessLookupError):
            running.kill()
        running.wait()


def shell(script: str) -> tuple[str, ...]:
    return ("sh", "-c", script)


def line(running: subprocess.Popen[str]) -> str:
    assert running.stdout is not None
    return running.stdout.readline().strip()


def output_of(running: subprocess.Popen[str]) -> str:
    assert running.stdout is not None
    return running.stdout.read()


def gone(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except (FileNotFoundError, ProcessLookupError):
        return True


@pytest.mark.parametrize(("script", "code"), [("exit 0", 0), ("exit 7", 7), ("kill -KILL $$", 137)])
def test_the_programs_exit_code_is_passed_on(master: Master, script: str, code: int) -> None:
    with client(master, *shell(script)) as running:
        assert running.wait(PATIENCE) == code


def test_a_program_that_is_not_there_is_named(master: Master) -> None:
    with client(master, "no-such-program") as running:
        assert running.wait(PATIENCE) == 127
        assert "no-such-program" in output_of(running)


@pytest.mark.parametrize("script", ["exit 0", "kill -TERM $$", "kill -INT $$"])
def test_with_forever_a_program_that_ends_has_failed(master: Master, script: str) -> None:
    with client(master, "--forever", *shell(script)) as running:
        assert running.wait(PATIENCE) == 1


def test_with_simulated_time_it_waits_for_the_parameter(
    master: Master, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mark = tmp_path / "started"
    monkeypatch.setenv("SWARM_USE_SIM_TIME", "1")
    with client(master, "touch", str(mark)) as running:
        time.sleep(1.5)
        assert not mark.exists()
        master.use_sim_time = True
        assert running.wait(PATIENCE) == 0
    assert mark.exists()


def test_nothing_starts_before_the_master_has_its_run_id(tmp_path: Path) -> None:
    late, mark = Master(), tmp_path / "started"
    late.open()
    late.close()
    with client(late, "touch", str(mark)) as running:
        time.sleep(1.5)
        assert not mark.exists()
        late.run_id = None  # as between rosmaster's start and roscore's first parameter
        late.open()
        time.sleep(1.5)
        assert not mark.exists()
        assert running.poll() is None
        late.run_id = "one"
        assert running.wait(PATIENCE) == 0
        assert mark.exists()
        assert late.uri in output_of(running)
    late.close()


def test_a_master_that_was_away_changes_nothing(master: Master) -> None:
    with client(master, "sleep", "60") as running:
        time.sleep(1.5)
        master.close()
        time.sleep(2.5)
        master.open()
        time.sleep(2.5)
        assert running.poll() is None


def test_a_restarted_master_ends_the_program(master: Master) -> None:
    with client(master, *shell(f"trap 'echo signalled; exit 0' INT; {READY}")) as running:
        assert line(running) == "ready"
        master.close()
        time.sleep(0.5)
        master.run_id = "two"
        master.open()
        assert running.wait(PATIENCE) == 75
        assert "signalled" in output_of(running)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGUSR1])
def test_signals_reach_the_program(master: Master, number: signal.Signals) -> None:
    name = number.name[3:]
    with client(master, *shell(f"trap 'exit 9' {name}; {READY}")) as running:
        assert line(running) == "ready"
        running.send_signal(number)
        assert running.wait(PATIENCE) == 9


def test_a_program_that_was_stopped_has_not_failed(master: Master) -> None:
    with client(master, "--forever", *shell(f"trap 'exit 0' TERM; {READY}")) as running:
        assert line(running) == "ready"
        running.send_signal(signal.SIGTERM)
        assert running.wait(PATIENCE) == 0


def test_nothing_that_the_program_started_outlives_it(master: Master, tmp_path: Path) -> None:
    """roslaunch gives each node a process group of its own; a killed roslaunch leaves them behind."""
    stays = "trap '' INT HUP; echo $$ > pid; while :; do sleep 0.1; done"
    with client(
        master, *shell(f'setsid sh -c "{stays.replace("$", chr(92) + "$")}" & sleep 0.5'), cwd=tmp_path
    ) as running:
        assert running.wait(PATIENCE) == 0
    assert gone(int((tmp_path / "pid").read_text()))


def test_a_program_that_ignores_signals_is_killed(master: Master) -> None:
    with client(master, *shell("trap '' INT; echo $$; while :; do sleep 0.1; done")) as running:
        child = int(line(running))
        master.run_id = "two"
        time.sleep(2.5)
        running.send_signal(signal.SIGTERM)  # as systemd does when it cannot wait
        assert running.wait(PATIENCE) == 75
        assert gone(child)


def test_keys_of_a_terminal_reach_the_program_and_a_ctrl_c_once(master: Master) -> None:
    script = "trap 'echo interrupted' INT; echo ready; read line; read line || read line; echo got $line"
    process, terminal = pty.fork()
    if process == 0:
        os.environ["ROS_MASTER_URI"] = master.uri
        os.execv(sys.executable, [sys.executable, str(CLIENT), "bash", "-c", script])
    shown = b""

    def shows(text: bytes) -> bool:
        nonlocal shown
        with suppress(OSError):
            shown += os.read(terminal, 4096)
        return text in shown

    wait_for(lambda: shows(b"ready"))
    os.write(terminal, b"\x03")
    wait_for(lambda: shows(b"interrupted"))
    os.write(terminal, b"first\nsecond\n")
    wait_for(lambda: shows(b"got "))
    assert os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]) == 0
    assert shown.count(b"interrupted") == 1
    os.close(terminal)


#: A node of roscpp is like this: it closes what it has open after SIGINT, and SIGTERM kills it.
NODE = """
import os, signal, sys, time
def close(*_):
    time.sleep(float(sys.argv[1]))
    os.write(1, b"closed\\n")  # print() fails where it has interrupted print()
    sys.exit(0)
signal.signal(signal.SIGINT, close)
print("ready", flush=True)
time.sleep(60)
"""


def test_a_program_that_handles_only_ctrl_c_closes_its_files(master: Master) -> None:
    with client(master, "--forever", sys.executable, "-c", NODE, "0") as running:
        assert line(running) == "ready"
        running.send_signal(signal.SIGTERM)
        assert running.wait(PATIENCE) == 0
        assert output_of(running) == "closed\n"


def test_what_a_stopped_program_leaves_behind_closes_its_files(master: Master, tmp_path: Path) -> None:
    """A shell ends at once, as `rosbag` does; the recorder of a large bag takes seconds."""
    (tmp_path / "node.py").write_text(NODE)
    with client(master, "bash", "-c", f"{sys.executable} {tmp_path}/node.py 4; echo went on") as running:
        assert line(running) == "ready"
        running.send_signal(signal.SIGTERM)
        assert running.wait(PATIENCE) == 143
        assert output_of(running) == "closed\n"
