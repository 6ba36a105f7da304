"""Files of the user are replaced atomically: the old content or the new, and nothing left beside it."""

from __future__ import annotations

import resource
from pathlib import Path

import pytest
import typer

from swarmctl.cli import exit_codes, file_writes
from swarmctl.cli.app import run


def test_a_write_that_fails_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "swarm.known_hosts"
    path.write_bytes(b"old")

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(typer.Exit) as ended:
        file_writes.replace(path, b"new")
    assert ended.value.exit_code == 1
    assert f"cannot write {path}: No space left on device" in capsys.readouterr().err.replace("\n", "")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_mode_and_link_of_an_old_file_stay(tmp_path: Path) -> None:
    old, link, new = tmp_path / "old", tmp_path / "link", tmp_path / "new"
    old.write_bytes(b"old")
    old.chmod(0o640)
    link.symlink_to(old)

    file_writes.replace(link, b"changed")
    file_writes.replace(new, b"new")

    assert (link.readlink(), old.read_bytes(), old.stat().st_mode & 0o777) == (old, b"changed", 0o640)
    assert (new.read_bytes(), new.stat().st_mode & 0o777) == (b"new", 0o644)
    assert {one.name for one in tmp_path.iterdir()} == {"link", "new", "old"}


@pytest.mark.parametrize(
    "command",
    ["init swarm", "driver new beetle", "driver new beetle --protocol python", "schema --out swarm"],
)
def test_a_file_that_does_not_fit_is_named_and_no_part_of_it_stays(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10, before[1]))  # as on a full disk, the error has no name
    try:
        code = run(command.split())
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert code == exit_codes.ERROR
    error = capsys.readouterr().err
    assert "File too large" in error
    assert "cannot write " + ("robots/beetle" if "new" in command else "swarm/") in error
    assert not [one for one in tmp_path.rglob("*") if one.is_file()]
