"""A file moves here whole or not at all, wherever the connection breaks off."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from swarmctl.remote import host_recordings
from swarmctl.remote.transport import HostError, Kind, Session, WorkerSession
from tests.remote.conftest import AnySsh
from tests.remote.sshd import Sshd

CONTENT = os.urandom(8_000_000)  # more than a connection holds


@pytest.fixture
def there(tmp_path: Path) -> Path:
    """A file of the host, with a name that a shell would take apart."""
    folder = tmp_path / "there"
    folder.mkdir()
    (folder / "a $(b)'.bag").write_bytes(CONTENT)
    return folder / "a $(b)'.bag"


def moved(session: Session, there: Path, place: Path) -> list[int]:
    """Moves the file; returns how many bytes were here after each piece."""
    assert not isinstance(session, WorkerSession)
    received: list[int] = []
    host_recordings.move(session, str(there), place, received.append)
    return received


@pytest.mark.parametrize("share", [0.0, 0.3, 0.5])
def test_a_broken_transfer_goes_on_where_it_ended(
    sshd: Sshd, transport: AnySsh, there: Path, tmp_path: Path, share: float
) -> None:
    place = tmp_path / "here.bag"
    reached = 0

    def cut(count: int) -> None:
        nonlocal reached
        if count >= share * len(CONTENT) and count:
            reached = count
            session.close()

    with transport.connect(sshd.target()) as session:
        assert not isinstance(session, WorkerSession)
        with pytest.raises(HostError):
            host_recordings.move(session, str(there), place, cut)
    assert not place.exists(), "nothing that is not whole has the name"
    assert there.exists()
    with transport.connect(sshd.target()) as session:
        received = moved(session, there, place)
    assert min(received) >= reached > 0
    assert place.read_bytes() == CONTENT
    assert [one.name for one in tmp_path.iterdir() if one.is_file()] == ["here.bag"]
    assert not there.exists(), "the host has its space back"


def test_a_damaged_file_comes_again(sshd: Sshd, transport: AnySsh, there: Path, tmp_path: Path) -> None:
    place = tmp_path / "here.bag"
    with transport.connect(sshd.target()) as session:
        assert not isinstance(session, WorkerSession)
        with pytest.raises(HostError):
            host_recordings.move(session, str(there), place, lambda _: session.close())
        (part,) = tmp_path.glob(".here.bag.*.part")
        part.write_bytes(b"x" + part.read_bytes()[1:])
    with transport.connect(sshd.target()) as session:
        with pytest.raises(HostError) as raised:
            moved(session, there, place)
        assert raised.value.retryable
        moved(session, there, place)
    assert place.read_bytes() == CONTENT


def test_a_file_that_is_here_stays(sshd: Sshd, transport: AnySsh, there: Path, tmp_path: Path) -> None:
    place = tmp_path / "here.bag"
    place.write_bytes(b"another")
    with transport.connect(sshd.target()) as session:
        with pytest.raises(HostError) as raised:
            moved(session, there, place)
        assert raised.value.kind is Kind.FAILED
        assert place.read_bytes() == b"another"
        assert there.exists()
        place.write_bytes(CONTENT)
        assert moved(session, there, place) == []
    assert not there.exists()


def test_a_folder_that_cannot_be_written_is_named(sshd: Sshd, transport: AnySsh, there: Path) -> None:
    place = there.parent / "no-folder/here.bag"
    with transport.connect(sshd.target()) as session, pytest.raises(HostError) as raised:
        moved(session, there, place)
    assert str(place) in raised.value.message
    assert there.exists()
