"""Files of programs beside ROS: left alone where the program is not, read again when they change, undone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from swarmctl.render.bundle import Bundle, File
from tests.onboard.agent.fakehost import FakeHost, bundle

CONF = "# the distribution's\npool ntp.example iburst\n"


def prepared(text: str) -> Bundle:
    """A release with a clock, and settings for NetworkManager."""
    plain = bundle("1")
    return replace(
        plain,
        files=(*plain.files, File("chrony/block", text.encode()), File("network/wlan.conf", b"[x]\n")),
        links={**plain.links, "/etc/NetworkManager/conf.d/swarm-new.conf": "network/wlan.conf"},
        blocks={**plain.blocks, "/etc/chrony/chrony.conf": "chrony/block"},
    )


FIRST, SECOND = prepared("server 10.0.0.1\n"), prepared("server 10.0.0.2\n")


@pytest.fixture
def bare(tmp_path: Path) -> FakeHost:
    return FakeHost(tmp_path)


@pytest.fixture
def host(bare: FakeHost) -> FakeHost:
    """A host on which chrony and NetworkManager run."""
    (bare.prefix / "etc/chrony").mkdir()
    (bare.prefix / "etc/chrony/chrony.conf").write_text(CONF)
    (bare.prefix / "etc/NetworkManager/conf.d").mkdir(parents=True)
    for unit in ("chrony.service", "NetworkManager.service"):
        (bare.prefix / "etc/systemd/system" / unit).write_text("")
        (bare.prefix / "units" / unit).write_text("7 none\n")
    return bare


def again(host: FakeHost) -> list[str]:
    return [call for call in host.calls() if "restart -- " in call]


def test_a_missing_program_gets_no_files_and_is_no_deviation(bare: FakeHost) -> None:
    assert bare.apply(FIRST).answer["release"] == FIRST.digest
    seen = bare.observe(known_release=FIRST.digest)
    assert not (bare.prefix / "etc/chrony").exists()
    assert not (bare.prefix / "etc/NetworkManager").exists()
    assert again(bare) == []
    assert seen.drift == ({}, {}, {})
    assert seen.facts.absent == ["/etc/NetworkManager/conf.d", "/etc/chrony/chrony.conf"]


def test_a_program_that_came_later_is_seen(bare: FakeHost) -> None:
    bare.apply(FIRST)
    (bare.prefix / "etc/chrony").mkdir()
    (bare.prefix / "etc/chrony/chrony.conf").write_text(CONF)
    assert bare.observe().drift.blocks == {"/etc/chrony/chrony.conf": "missing"}


def test_only_a_changed_file_is_read_again(host: FakeHost) -> None:
    host.apply(FIRST)
    assert "server 10.0.0.1" in host.outside()["chrony/chrony.conf"]
    assert again(host) == ["restart -- chrony.service", "reload-or-restart -- NetworkManager.service"]
    host.apply(SECOND, previous=FIRST.digest, start=[])
    assert "server 10.0.0.2" in host.outside()["chrony/chrony.conf"]
    assert again(host) == ["restart -- chrony.service"]
    host.apply(SECOND, previous=SECOND.digest, start=[])
    assert again(host) == []


def test_a_program_that_does_not_run_is_not_started(host: FakeHost) -> None:
    (host.prefix / "units/chrony.service").unlink()
    host.apply(FIRST)
    assert again(host) == ["reload-or-restart -- NetworkManager.service"]


def test_undone_and_removed_the_files_are_as_before_and_read_again(host: FakeHost) -> None:
    before = host.outside()
    assert host.apply(FIRST, failpoint="error:start").error["kind"] == "failed"
    assert host.outside() == before
    assert again(host)[-2:] == ["restart -- chrony.service", "reload-or-restart -- NetworkManager.service"]
    host.apply(FIRST)
    again(host)
    host.ask({"verb": "remove", "swarm": "new"})
    assert host.outside() == before
    assert (host.prefix / "etc/udev/rules.d").is_dir()
    assert again(host) == ["restart -- chrony.service", "reload-or-restart -- NetworkManager.service"]


@pytest.mark.parametrize("stranger", [False, True])
def test_folders_that_were_made_for_links_go_with_the_swarm(bare: FakeHost, stranger: bool) -> None:
    folder = bare.prefix / "etc/udev/rules.d"
    folder.rmdir()
    folder.parent.rmdir()
    plain = bundle("1")
    rules = File("udev/90.rules", b"# rules\n")
    bare.apply(
        replace(
            plain,
            files=(*plain.files, rules),
            links={**plain.links, "/etc/udev/rules.d/90.rules": rules.path},
        )
    )
    assert folder.is_dir()
    if stranger:
        (folder / "10-mine.rules").touch()
    bare.ask({"verb": "remove", "swarm": "new"})
    assert [one.name for one in (bare.prefix / "etc/udev").glob("*")] == (["rules.d"] if stranger else [])
    assert folder.parent.exists() is stranger


def test_what_is_wanted_is_looked_for_where_root_finds_it(host: FakeHost) -> None:
    (host.prefix / "usr/sbin").mkdir(parents=True)
    (host.prefix / "usr/sbin/chronyd").touch(0o755)
    (host.prefix / "sys/class/net/wlan0/phy80211").mkdir(parents=True)
    (host.prefix / "sys/class/net/eth0").mkdir()
    facts = host.observe(wants=["chronyd", "iw", "../evil"]).facts
    assert facts.has["chronyd"] == "/usr/sbin/chronyd"
    assert facts.has["iw"] is None
    assert "../evil" not in facts.has
    assert facts.clock in ("follows", "alone", "borrowed")
    assert facts.power_save == {"wlan0": ""}
    bare = host.observe().facts
    assert (bare.clock, bare.power_save) == (None, None)
