from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from swarm_onboard.agent.release_store import Home
from swarm_onboard.command.command_log import RecordFile
from swarm_onboard.common.record_chain import FILE, OLDER
from swarm_onboard.host_checks.command_record import judge, observe

from tests.onboard.host_checks.hosts import program, with_unit

UNIT = "swarm-new.k3.service"


def host(
    folder: Path, monkeypatch: pytest.MonkeyPatch, state: str = "active"
) -> tuple[Home, RecordFile, Path]:
    """A host with a driver whose record has been full twice; the record and its folder."""
    home = with_unit(folder, UNIT, b"[Service]\nStateDirectory=swarm-commands/new/k3\n")
    program(folder, monkeypatch, "systemctl", f"echo Id={UNIT}; echo ActiveState={state}")
    place = folder / "var/lib/swarm-commands/new/k3"
    place.mkdir(parents=True)
    record = RecordFile(place, full=300)
    for number in range(12):
        record.append([{"event": "command", "by": f"pilot-{number}"}])
    return home, record, place


def emptied(place: Path) -> None:
    for name in (FILE, OLDER):
        (place / name).write_bytes(b"")


def edited(place: Path) -> None:
    content = (place / OLDER).read_bytes()
    (place / OLDER).write_bytes(content.replace(b"pilot", b"nobod", 1))


def shortened(place: Path) -> None:
    lines = (place / OLDER).read_bytes().splitlines(keepends=True)
    (place / OLDER).write_bytes(b"".join([lines[0], *lines[2:]]))


FAULTS: dict[str, tuple[Callable[[Path], object], str]] = {
    "emptied": (emptied, "is empty"),
    "removed": (lambda place: [path.unlink() for path in place.iterdir()], "is empty"),
    "edited": (edited, "is broken"),
    "without an entry": (shortened, "is broken"),
    "without its older file": (lambda place: (place / OLDER).unlink(), "entry 1 is missing"),
    "of other text": (lambda place: (place / OLDER).write_text("hello\n"), "is damaged"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_record_with_a_gap_is_bad(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    home, _, place = host(tmp_path, monkeypatch)
    spoil, message = FAULTS[name]
    spoil(place)
    (seen,) = observe(home)
    found = judge(seen, "pi")
    assert (found.state, message in found.message, found.about) == ("bad", True, "k3")


def test_a_record_emptied_while_it_goes_on_is_bad(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    home, record, place = host(tmp_path, monkeypatch)
    emptied(place)
    record.append([{"event": "command"}])
    (seen,) = observe(home)
    assert "is broken: entry 1 is missing" in judge(seen, "pi").message


def test_a_record_that_was_full_is_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    home, _, place = host(tmp_path, monkeypatch)
    assert b'"number": 1,' not in (place / OLDER).read_bytes()
    (seen,) = observe(home)
    assert judge(seen, "pi").state == "ok"


def test_a_unit_that_does_not_run_needs_no_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    home, _, place = host(tmp_path, monkeypatch, state="inactive")
    emptied(place)
    assert observe(home) == []
