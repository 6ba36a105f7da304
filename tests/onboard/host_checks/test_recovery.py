from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from swarm_onboard.agent import record, recovery_unit
from swarm_onboard.agent.release_store import Home
from swarm_onboard.host_checks.recovery import judge, observe

from tests.onboard.host_checks.hosts import program

SITE = "/etc/systemd/system/swarm-recovery@new.service.d/site.conf"


def host(
    folder: Path, monkeypatch: pytest.MonkeyPatch, drop_in: str | None = None
) -> tuple[Home, Path, Path]:
    """A host with a release, as a deploy leaves it; its recovery unit and the link to that.

    Its systemctl shows a drop-in with this text.
    """
    (folder / SITE[1:]).parent.mkdir(parents=True)
    (folder / SITE[1:]).write_text(drop_in or "")
    shown = SITE if drop_in else ""
    program(folder, monkeypatch, "systemctl", f"echo Id=swarm-recovery@new.service; echo DropInPaths={shown}")
    home = Home("new", str(folder))
    Path(home.state).mkdir(parents=True)
    Path(home.current_link).symlink_to("releases/0123456789abcdef")
    unit, link = (folder / path[1:] for path in recovery_unit.paths(home))
    recovery_unit.install(home)
    record.write(home, record.Record(state=record.APPLIED, next="0123456789abcdef"))
    with zipfile.ZipFile(home.recovery_code, "w") as archive:
        archive.writestr("swarm_onboard/agent/recovery.py", "print('undone')\n" * 20)
    return home, unit, link


def masked(home: Home, unit: Path, link: Path) -> None:
    unit.unlink()
    unit.symlink_to("/dev/null")


def edited(home: Home, unit: Path, link: Path) -> None:
    unit.write_text(unit.read_text().replace("ExecStart=", "ExecStart=/bin/true "))


def damaged(home: Home, unit: Path, link: Path) -> None:
    content = bytearray(Path(home.recovery_code).read_bytes())
    content[60] ^= 1
    Path(home.recovery_code).write_bytes(content)


FAULTS: dict[str, Callable[[Home, Path, Path], object]] = {
    "is masked": masked,
    "was changed": edited,
    "does not exist": lambda home, unit, link: unit.unlink(),
    "does not start at boot: its link is missing": lambda home, unit, link: link.unlink(),
    "state/agent.zip is missing or damaged": damaged,
    "cannot run: ": lambda home, unit, link: Path(home.recovery_code).unlink(),
    "state/transaction.json is missing or damaged": lambda home, unit, link: Path(
        home.record_file
    ).write_text("{"),
    "does not know what to undo: ": lambda home, unit, link: Path(home.record_file).unlink(),
}


@pytest.mark.parametrize("message", FAULTS)
def test_a_host_that_undoes_nothing_at_boot_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, message: str
) -> None:
    home, unit, link = host(tmp_path, monkeypatch)
    FAULTS[message](home, unit, link)
    (seen,) = observe(home)
    found = judge(seen, "pi")
    assert (found.state, message in found.message) == ("warning", True)
    Path(home.open_mark).touch()
    assert judge(observe(home)[0], "pi").state == "bad"


def test_a_drop_in_that_changes_how_it_starts_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home, _, _ = host(tmp_path, monkeypatch, "[Service]\nExecStart=\nExecStart=/bin/true\n")
    found = judge(observe(home)[0], "pi")
    assert (found.state, f"is changed: {SITE} has ExecStart=/bin/true" in found.message) == ("warning", True)
    assert "remove the drop-in" in found.hint
    Path(home.open_mark).touch()
    assert judge(observe(home)[0], "pi").state == "bad"


def test_a_drop_in_that_says_the_same_is_free(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    home, _, _ = host(tmp_path, monkeypatch, "[Service]\nTimeoutStartSec=2min\nNice=5\n")
    assert judge(observe(home)[0], "pi").state == "ok"


def test_a_unit_as_a_deploy_leaves_it_is_right(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    home, _, _ = host(tmp_path, monkeypatch)
    (seen,) = observe(home)
    assert judge(seen, "pi").state == "ok"


def test_a_host_without_a_release_needs_none(tmp_path: Path) -> None:
    assert observe(Home("new", str(tmp_path))) == []
