"""The small effects a lab is made of: locks, files of a disk, processes, the control socket."""

from __future__ import annotations

import errno
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from swarmctl.lab import control, disks, places, processes
from swarmctl.lab.errors import LabError

AS_ROOT = pytest.mark.skipif(os.geteuid() != 0, reason="needs root")


def within(seconds: float, condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, f"not within {seconds} s"
        time.sleep(0.01)


class TestLock:
    def test_one_at_a_time(self, tmp_path: Path) -> None:
        with (
            places.locked(tmp_path / "lab"),
            pytest.raises(LabError, match="another swarmctl is at work"),
            places.locked(tmp_path / "lab", patience=0.1),
        ):
            pass

    def test_let_go_afterwards(self, tmp_path: Path) -> None:
        for _ in range(2):
            with places.locked(tmp_path / "lab", patience=0.1):
                pass

    def test_a_folder_that_was_removed_meanwhile_is_made_again(self, tmp_path: Path) -> None:
        waited = threading.Event()

        def second() -> None:
            with places.locked(tmp_path / "lab"):
                waited.set()
                assert (tmp_path / "lab").is_dir()

        with places.locked(tmp_path / "lab"):
            thread = threading.Thread(target=second)
            thread.start()
            (tmp_path / "lab").rmdir()
        thread.join()
        assert waited.is_set()


class TestDiskFiles:
    @AS_ROOT
    def test_folders_keep_what_the_image_says(self, tmp_path: Path) -> None:
        base, upper = tmp_path / "image", tmp_path / "upper"
        (base / "etc/sudoers.d").mkdir(parents=True)
        (base / "etc/sudoers.d").chmod(0o750)
        upper.mkdir()
        disks.write(
            upper,
            base,
            [
                disks.Entry("etc/sudoers.d/x", "x", 0o440),
                disks.Entry("home/x/.ssh/authorized_keys", "k", 0o600, 1000),
            ],
        )
        found = {
            str(path.relative_to(upper)): (oct(path.stat().st_mode & 0o7777), path.stat().st_uid)
            for path in upper.rglob("*")
        }
        assert found["etc/sudoers.d"] == ("0o750", 0)
        assert found["etc/sudoers.d/x"] == ("0o440", 0)
        assert found["home/x"] == ("0o755", 1000)
        assert found["home/x/.ssh"] == ("0o700", 1000)
        assert found["home/x/.ssh/authorized_keys"] == ("0o600", 1000)


class TestProcesses:
    def test_a_program_that_fails_is_quoted(self) -> None:
        with pytest.raises(LabError, match="`sh -c echo no >&2; exit 3` failed: no"):
            processes.run(("sh", "-c", "echo no >&2; exit 3"))

    def test_found_by_arguments_and_ended(self) -> None:
        argument = f"/nowhere/{os.getpid()}"
        child = subprocess.Popen((sys.executable, "-c", "import time; time.sleep(60)", "mark", argument))
        try:
            while processes.with_arguments("mark", argument) != [child.pid]:
                time.sleep(0.01)
            assert processes.with_arguments("other", argument) == []
            processes.kill([child.pid])
            assert child.wait(5) == -signal.SIGKILL
        finally:
            child.kill()

    def test_never_ends_itself_or_what_called_it(self) -> None:
        processes.kill([os.getpid(), os.getppid()])

    def test_what_is_gone_already_is_no_trouble(self) -> None:
        child = subprocess.Popen(("true",))
        child.wait()
        processes.kill([child.pid])

    @AS_ROOT
    def test_sealed_programs_leave_no_process_and_no_mount(self, tmp_path: Path) -> None:
        mark = f"mark-{os.getpid()}"
        behind = f"setsid sh -c 'sleep 60; :' {mark}"
        script = f"mount -t tmpfs none {tmp_path}; touch {tmp_path}/in; {behind} & sleep 60"
        child = subprocess.Popen(processes.sealed(("sh", "-c", script)))
        try:
            within(10, lambda: bool(processes.with_arguments(mark)))
            assert list(tmp_path.iterdir()) == [], "a mount of a sealed program is seen outside"
            child.kill()
            within(10, lambda: not processes.with_arguments(mark))
        finally:
            child.kill()
            child.wait()

    @AS_ROOT
    def test_what_runs_in_a_network_namespace_is_found(self) -> None:
        child = subprocess.Popen(("unshare", "--net", "sleep", "60"))
        try:
            own = Path(f"/proc/{child.pid}/ns/net")
            within(10, lambda: own.stat().st_ino != Path("/proc/self/ns/net").stat().st_ino)
            assert processes.in_network_namespaces([own, Path("/nowhere")]) == [child.pid]
        finally:
            child.kill()
            child.wait()


class TestControl:
    @pytest.fixture
    def path(self, tmp_path: Path) -> Path:
        """A socket whose path is far too long for an address, answered by an echo that refuses ``no``."""
        folder = tmp_path / ("long" * 30)
        folder.mkdir()
        server = control.listen(folder / "control")

        def answer(request: Mapping[str, Any]) -> Mapping[str, Any]:
            if request["do"] == "no":
                raise LabError("refused", "ask for something else")
            if request["do"] == "full":
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            return {"heard": request}

        threading.Thread(target=control.serve, args=(server, answer), daemon=True).start()
        return folder / "control"

    def test_question_and_answer(self, path: Path) -> None:
        assert control.ask(path, {"do": "x"}) == {"heard": {"do": "x"}}

    def test_a_refusal_arrives_as_an_error(self, path: Path) -> None:
        with pytest.raises(LabError, match="refused") as caught:
            control.ask(path, {"do": "no"})
        assert caught.value.help_lines == ("ask for something else",)

    @pytest.mark.parametrize(
        "noise", [b"", b"\n", b"{\n", b"\xff\xfe\n", b"[]\n", b'{"do": []}\n', b'"do"\n']
    )
    def test_noise_costs_only_the_noisy(self, path: Path, noise: bytes) -> None:
        with socket.socket(socket.AF_UNIX) as connection:
            folder = os.open(path.parent, os.O_PATH)
            connection.connect(f"/proc/self/fd/{folder}/{path.name}")
            os.close(folder)
            connection.sendall(noise)
        assert control.ask(path, {"do": "x"}) == {"heard": {"do": "x"}}

    def test_what_the_system_refuses_is_told(self, path: Path) -> None:
        with pytest.raises(LabError, match=r"could not do that: .*No space"):
            control.ask(path, {"do": "full"})

    def test_root_alone_may_ask(self, path: Path) -> None:
        assert path.stat().st_mode & 0o777 == 0o600

    def test_nobody_there(self, tmp_path: Path) -> None:
        with pytest.raises(FileNotFoundError):
            control.ask(tmp_path / "control", {})
