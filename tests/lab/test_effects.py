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
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from swarmctl.lab import paths, supervisor_client
from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import disks, processes
from tests.timing import PATIENCE, wait_for

AS_ROOT = pytest.mark.skipif(os.geteuid() != 0, reason="needs root")


class TestLock:
    def test_one_at_a_time(self, tmp_path: Path) -> None:
        with (
            paths.locked(tmp_path / "lab"),
            pytest.raises(LabError, match="another swarmctl is using"),
            paths.locked(tmp_path / "lab", timeout=0.1),
        ):
            pass

    def test_released_afterwards(self, tmp_path: Path) -> None:
        for _ in range(2):
            with paths.locked(tmp_path / "lab", timeout=0.1):
                pass

    def test_a_folder_that_was_removed_is_created_again(self, tmp_path: Path) -> None:
        waited = threading.Event()

        def second() -> None:
            with paths.locked(tmp_path / "lab"):
                waited.set()
                assert (tmp_path / "lab").is_dir()

        with paths.locked(tmp_path / "lab"):
            thread = threading.Thread(target=second)
            thread.start()
            (tmp_path / "lab").rmdir()
        thread.join()
        assert waited.is_set()


class TestDiskFiles:
    @AS_ROOT
    def test_folders_keep_mode_and_owner_of_the_image(self, tmp_path: Path) -> None:
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
    def test_the_error_of_a_failed_program_is_reported(self) -> None:
        with pytest.raises(LabError, match="`sh -c echo no >&2; exit 3` failed: no"):
            processes.run(("sh", "-c", "echo no >&2; exit 3"))

    def test_found_by_arguments_and_killed(self) -> None:
        argument = f"/nowhere/{os.getpid()}"
        child = subprocess.Popen((sys.executable, "-c", "import time; time.sleep(60)", "mark", argument))
        try:
            while processes.with_arguments("mark", argument) != [child.pid]:
                time.sleep(0.01)
            assert processes.with_arguments("other", argument) == []
            processes.kill([child.pid])
            assert child.wait(PATIENCE) == -signal.SIGKILL
        finally:
            child.kill()

    def test_never_kills_itself_or_its_parents(self) -> None:
        processes.kill([os.getpid(), os.getppid()])

    def test_a_process_that_is_gone_is_no_error(self) -> None:
        child = subprocess.Popen(("true",))
        child.wait()
        processes.kill([child.pid])

    @AS_ROOT
    def test_isolated_programs_leave_no_process_and_no_mount(self, tmp_path: Path) -> None:
        mark = f"mark-{os.getpid()}"
        behind = f"setsid sh -c 'sleep 60; :' {mark}"
        script = f"mount -t tmpfs none {tmp_path}; touch {tmp_path}/in; {behind} & sleep 60"
        child = subprocess.Popen(processes.isolated(("sh", "-c", script)))
        try:
            wait_for(lambda: bool(processes.with_arguments(mark)))
            assert list(tmp_path.iterdir()) == [], "a mount of a sealed program is seen outside"
            child.kill()
            wait_for(lambda: not processes.with_arguments(mark))
        finally:
            child.kill()
            child.wait()

    @AS_ROOT
    def test_processes_of_a_network_namespace_are_found(self) -> None:
        child = subprocess.Popen(("unshare", "--net", "sleep", "60"))
        try:
            own = Path(f"/proc/{child.pid}/ns/net")
            wait_for(lambda: own.stat().st_ino != Path("/proc/self/ns/net").stat().st_ino)
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
        server = supervisor_client.listen(folder / "control")

        def answer(request: Mapping[str, Any]) -> Mapping[str, Any]:
            if request["do"] == "no":
                raise LabError("refused", "ask for something else")
            if request["do"] == "full":
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            return {"received": request}

        threading.Thread(target=supervisor_client.serve, args=(server, answer), daemon=True).start()
        return folder / "control"

    def test_request_and_answer(self, path: Path) -> None:
        assert supervisor_client.send(path, {"do": "x"}) == {"received": {"do": "x"}}

    def test_a_refusal_arrives_as_an_error(self, path: Path) -> None:
        with pytest.raises(LabError, match="refused") as caught:
            supervisor_client.send(path, {"do": "no"})
        assert caught.value.help_lines == ("ask for something else",)

    @pytest.mark.parametrize(
        "noise", [b"", b"\n", b"{\n", b"\xff\xfe\n", b"[]\n", b'{"do": []}\n', b'"do"\n']
    )
    def test_invalid_requests_do_not_disturb_others(self, path: Path, noise: bytes) -> None:
        with socket.socket(socket.AF_UNIX) as connection:
            folder = os.open(path.parent, os.O_PATH)
            connection.connect(f"/proc/self/fd/{folder}/{path.name}")
            os.close(folder)
            connection.sendall(noise)
        assert supervisor_client.send(path, {"do": "x"}) == {"received": {"do": "x"}}

    def test_system_errors_are_reported(self, path: Path) -> None:
        with pytest.raises(LabError, match=r"supervisor failed: .*No space"):
            supervisor_client.send(path, {"do": "full"})

    def test_only_root_may_send_requests(self, path: Path) -> None:
        assert path.stat().st_mode & 0o777 == 0o600

    def test_no_supervisor(self, tmp_path: Path) -> None:
        with pytest.raises(FileNotFoundError):
            supervisor_client.send(tmp_path / "control", {})
