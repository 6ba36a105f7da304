from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from swarm_onboard.agent import audit, record, transaction
from swarm_onboard.agent.record import Record
from swarm_onboard.agent.release_store import Home
from swarm_onboard.host_checks.audit import judge, observe

RELEASES = ("1" * 16, "2" * 16, "3" * 16)


def host(folder: Path) -> Home:
    """A host after three deploys, as they leave its log and its record."""
    home = Home("new", str(folder))
    home.prepare()
    for release in RELEASES:
        deployed(home, release, f"tx-{release}")
    return home


def deployed(home: Home, release: str, txid: str) -> None:
    Path(home.release(release)).mkdir(exist_ok=True)
    before = record.read(home)
    transaction.keep_change(
        home, Record(txid=txid, who="ann@desk", previous=before.next, next=release, history=before.history)
    )


def first_cut_off(log: Path) -> None:
    log.write_text("".join(log.read_text().splitlines(keepends=True)[1:]))


def last_cut_off(log: Path) -> None:
    log.write_text("".join(log.read_text().splitlines(keepends=True)[:-1]))


FAULTS: dict[str, tuple[Callable[[Path], object], str]] = {
    "emptied": (lambda log: log.write_text(""), "lacks the last one, by ann@desk; that to release 2"),
    "removed": (lambda log: log.unlink(), "lacks the last one, by ann@desk; that to release 2"),
    "of other text": (lambda log: log.write_text("hello\n"), "lacks the last one, by ann@desk"),
    "without its end": (last_cut_off, "lacks the last one, by ann@desk"),
    "without its beginning": (first_cut_off, f"lacks that to release {RELEASES[0]}"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_log_without_the_last_changes_is_named(tmp_path: Path, name: str) -> None:
    home = host(tmp_path)
    spoil, message = FAULTS[name]
    spoil(Path(home.audit_file))
    (seen,) = observe(home)
    found = judge(seen, "pi")
    assert (found.state, message in found.message) == ("warning", True)


def test_a_log_as_deploys_leave_it_is_whole(tmp_path: Path) -> None:
    home = host(tmp_path)
    (seen,) = observe(home)
    assert judge(seen, "pi").state == "ok"


def test_a_log_that_is_full_may_lack_old_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(audit, "KEPT", 2)
    home = host(tmp_path)
    assert len(audit.entries(home)) == 2
    (seen,) = observe(home)
    assert judge(seen, "pi").state == "ok"


@pytest.mark.parametrize("state", [record.APPLYING, record.PENDING, record.SWITCHING])
def test_a_change_that_has_not_ended_is_in_no_log(tmp_path: Path, state: str) -> None:
    home = host(tmp_path)
    Path(home.current_link).symlink_to(f"releases/{RELEASES[2]}")
    record.write(home, Record(state=state, txid="tx", next=RELEASES[2]))
    assert observe(home) == []


def test_a_host_without_a_release_has_no_log(tmp_path: Path) -> None:
    assert observe(Home("new", str(tmp_path))) == []
