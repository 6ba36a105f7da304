"""What people edit on a host is not replaced without a word, and never lost."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.adoption.changes import EditedFile
from swarmctl.deploy.observe_host import edits_on_hosts
from swarmctl.remote.transport import HostError, Kind
from tests.deploy.deploying import deploy
from tests.deploy.test_rollout import HOSTS, TARGETS, FolderTransport, bundles, changed, deployed, hosts
from tests.onboard.agent.fakehost import FakeHost

__all__ = ["hosts"]
EDIT = "speed: 7  # the carpet is slow\n"
SLOW = dict.fromkeys(HOSTS, "speed: 2\n")


@pytest.fixture
def edited(hosts: dict[str, FakeHost]) -> dict[str, FakeHost]:
    deployed(deploy(bundles(), TARGETS, FolderTransport(hosts, {})))
    params(hosts["k3"]).write_text(EDIT)
    return hosts


def params(host: FakeHost) -> Path:
    return host.prefix / "opt/swarm/new/current/params/robot.yaml"


def copies(host: FakeHost) -> list[str]:
    return sorted(path.read_text() for path in (host.prefix / "opt/swarm/new/state/edits").rglob("*.yaml"))


@pytest.mark.parametrize("wanted", [{}, SLOW], ids=["spec unchanged", "spec changed too"])
def test_an_edit_holds_all_hosts_back(edited: dict[str, FakeHost], wanted: dict[str, str]) -> None:
    results = deployed(deploy(bundles(**wanted), TARGETS, FolderTransport(edited, {}), most_failed=0))
    assert changed(results)["k3"] is Kind.EDITED
    assert str(results["k3"]) == "params/robot.yaml was edited on the host"
    assert (
        "`deploy --overwrite-edits` replaces it, with a copy in /opt/swarm/new/state/edits"
        in results["k3"].hint
    )
    if wanted:
        why = "nothing was changed, since k3 has files that were edited there"
        assert {str(results[name]) for name in HOSTS if name != "k3"} == {why}
    assert params(edited["k3"]).read_text() == EDIT
    assert params(edited["leader"]).read_text() == "speed: 1\n"


@pytest.mark.parametrize("wanted", [{}, SLOW], ids=["spec unchanged", "spec changed too"])
def test_a_replaced_edit_is_kept_on_the_host(edited: dict[str, FakeHost], wanted: dict[str, str]) -> None:
    for _ in range(2):
        way = FolderTransport(edited, {})
        assert changed(deployed(deploy(bundles(**wanted), TARGETS, way, overwrite_edits=True)))["k3"] is True
        assert params(edited["k3"]).read_text() == wanted.get("k3", "speed: 1\n")
        params(edited["k3"]).write_text(EDIT)
    assert copies(edited["k3"]) == [EDIT]
    folder = edited["k3"].prefix / "opt/swarm/new/state/edits"
    assert folder.stat().st_mode & 0o077 == 0


def test_an_edit_that_the_spec_has_by_now_is_no_conflict(edited: dict[str, FakeHost]) -> None:
    results = deployed(deploy(bundles(k3=EDIT), TARGETS, FolderTransport(edited, {}), most_failed=0))
    assert changed(results) == {"leader": False, "k3": True, "epuck": False}
    assert edited["k3"].observe().drift == ({}, {}, {})


def test_layout_and_comments_of_an_edit_are_no_conflict(edited: dict[str, FakeHost]) -> None:
    way = FolderTransport(edited, {})
    results = deployed(deploy(bundles(k3="{speed: 7.0}\n"), TARGETS, way, most_failed=0))
    assert changed(results)["k3"] is True
    assert params(edited["k3"]).read_text() == "{speed: 7.0}\n"
    assert copies(edited["k3"]) == [EDIT]


def test_edits_are_read_with_their_texts(edited: dict[str, FakeHost]) -> None:
    params(edited["k3"]).with_name("notes.yaml").write_text("ask Ann\n")
    away = {"epuck": HostError(Kind.UNREACHABLE, "no route")}
    found = edits_on_hosts(bundles(), TARGETS, FolderTransport(edited, away), parallel=4)
    path = "params/robot.yaml"
    deployed_one = bundles()["k3"].manifest["files"][path]["sha256"]
    assert found == {
        "leader": [],
        "k3": [
            EditedFile("k3", path, path, EDIT, deployed_one),
            EditedFile("k3", "params/notes.yaml", "params/notes.yaml", None, ""),
        ],
        "epuck": away["epuck"],
    }


@pytest.mark.parametrize(
    "content",
    [b"\xff\xfe", b"x" * ((64 << 10) + 1), b"-----BEGIN RSA PRIVATE KEY-----\n", "link"],
    ids=["binary", "long", "private key", "link"],
)
def test_the_text_of_an_edit_stays_on_the_host(edited: dict[str, FakeHost], content: bytes | str) -> None:
    place = params(edited["k3"])
    if isinstance(content, str):
        place.unlink()
        place.symlink_to("/etc/shadow")
    else:
        place.write_bytes(content)
    found = edits_on_hosts(bundles(), TARGETS, FolderTransport(edited, {}), parallel=4)["k3"]
    assert [(one.path, one.text) for one in found] == [("params/robot.yaml", None)]  # type: ignore[union-attr]


def test_a_file_that_people_added_is_kept_too(edited: dict[str, FakeHost]) -> None:
    params(edited["k3"]).write_text("speed: 1\n")
    notes = params(edited["k3"]).with_name("notes.yaml")
    notes.write_text("ask Ann\n")
    way = FolderTransport(edited, {})
    assert changed(deployed(deploy(bundles(), TARGETS, way)))["k3"] is Kind.EDITED
    assert changed(deployed(deploy(bundles(), TARGETS, way, overwrite_edits=True)))["k3"] is True
    assert not notes.exists()
    assert copies(edited["k3"]) == ["ask Ann\n"]


@pytest.mark.parametrize("lost", ["mode", "file"])
def test_what_is_no_edit_is_repaired_without_a_word(edited: dict[str, FakeHost], lost: str) -> None:
    params(edited["k3"]).write_text("speed: 1\n")
    if lost == "mode":
        params(edited["k3"]).chmod(0o600)
    else:
        params(edited["k3"]).unlink()
    way = FolderTransport(edited, {})
    assert changed(deployed(deploy(bundles(), TARGETS, way, most_failed=0)))["k3"] is True
    assert params(edited["k3"]).read_text() == "speed: 1\n"
    assert params(edited["k3"]).stat().st_mode & 0o777 == 0o644


def test_only_so_many_copies_are_kept(edited: dict[str, FakeHost]) -> None:
    host = edited["k3"]
    place = host.prefix / "opt/swarm/new/state/edits"
    for number in range(100):
        (place / f"{number:012}").mkdir(parents=True)
        (place / f"{number:012}" / "robot.yaml").write_text(str(number))
    deployed(deploy(bundles(), TARGETS, FolderTransport(edited, {}), overwrite_edits=True))
    assert len(copies(host)) == 100
    assert EDIT in copies(host)
