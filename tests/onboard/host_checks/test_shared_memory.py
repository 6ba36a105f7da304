from __future__ import annotations

import os
from pathlib import Path

import pytest
from swarm_onboard.agent.release_store import Home
from swarm_onboard.host_checks.shared_memory import Seen, judge, observe

KEPT, LEFT = "fastdds_0123456789abcdef", "fastrtps_fedcba9876543210"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in (KEPT, f"{KEPT}_el", LEFT, f"{LEFT}_el", "fastdds_port7411", "other"):
        (tmp_path / name).write_bytes(bytes(8192))
    return tmp_path


def locks(folder: Path, *names: str) -> str:
    """A list of locks as the kernel has it."""
    lines = ["1: POSIX  ADVISORY  WRITE 7 00:01:9 0 EOF"]
    for name in names:
        status = (folder / name).stat()
        place = f"{os.major(status.st_dev):02x}:{os.minor(status.st_dev):02x}:{status.st_ino}"
        lines.append(f"2: FLOCK  ADVISORY  WRITE 68 {place} 0 EOF")
    (folder / "locks").write_text("\n".join(lines) + "\n")
    return str(folder / "locks")


def test_what_no_process_has_locked_is_counted(folder: Path) -> None:
    [found] = observe(Home("new"), str(folder), locks(folder, f"{KEPT}_el"))
    assert (found.segments, found.size > 0) == (1, True)
    assert judge(found, "pi").state == "ok"


def test_nothing_left_is_no_finding(folder: Path) -> None:
    assert observe(Home("new"), str(folder), locks(folder, f"{KEPT}_el", f"{LEFT}_el")) == []


def test_much_of_it_is_a_warning() -> None:
    found = judge(Seen(20, 10 << 20, 64 << 20), "pi")
    assert (found.state, found.hint) == ("warning", "on pi: fastdds shm clean")
    assert found.message == "20 segments of nodes that were killed, 10.0 MiB of 64"
