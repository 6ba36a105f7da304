"""``remove --orphans``: hosts that left the spec are reached as the last deploy reached them."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest
from swarm_onboard.agent.host_list import HostLogin

from swarmctl.cli import exit_codes, ssh_targets
from swarmctl.cli.app import run
from swarmctl.cli.ssh_targets import NamedHosts
from swarmctl.cli.where import Where
from swarmctl.deploy import journal
from swarmctl.remote.transport import HostError, Kind, Session, Target
from tests.onboard.agent.fakehost import FakeHost
from tests.onboard.agent.local_session import LocalSession

HOST_LIST = "opt/swarm/newswarm/state/hosts.json"
LOGIN = HostLogin(address="192.0.2.7", user="ann", port=2222, via=None, declared=["user"])


def fake(folder: Path) -> FakeHost:
    """A host with a release of the swarm, whose agent may use sudo."""
    host = FakeHost(folder)
    swarm = host.prefix / "opt/swarm/newswarm"
    (swarm / "releases" / ("0" * 16)).mkdir(parents=True)
    (swarm / "current").symlink_to("releases/" + "0" * 16)
    sudo = host.prefix / "bin/sudo"
    sudo.write_text('#!/bin/sh\nshift\nexec "$@"\n')
    sudo.chmod(0o755)
    return host


@pytest.fixture
def elsewhere() -> dict[str, FakeHost]:
    """Hosts of the spec that answer, by name."""
    return {}


@pytest.fixture
def left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, elsewhere: dict[str, FakeHost]) -> FakeHost:
    """A host with a release of the swarm, which the spec has no more."""
    host = fake(tmp_path / "old-pi")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "journal"))
    journal.remember(journal.folder("newswarm"), "old-pi", "0" * 16, {}, LOGIN)

    @contextmanager
    def connect(target: Target) -> Iterator[Session]:
        if target.host in elsewhere:
            yield LocalSession(elsewhere[target.host].environment())
            return
        if target.host != "old-pi":
            raise HostError(Kind.UNREACHABLE, f"no route to {target.host}")
        assert (target.address, target.user, target.port) == ("192.0.2.7", "ann", 2222)
        yield LocalSession(host.environment())

    class Transport:
        def __init__(self) -> None:
            self.connect = connect

    def targets(_spec: object, swarm: NamedHosts, **_: object) -> Mapping[str, Target]:
        return {one.name: Target(one.name, one.address, one.user, one.port) for one in swarm.hosts.values()}

    monkeypatch.setattr(Where, "targets", targets)
    monkeypatch.setattr(ssh_targets, "transport", Transport)
    return host


def test_a_host_that_left_the_spec_is_removed_where_it_was_reached(
    left: FakeHost, leader_spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["remove", str(leader_spec), "--orphans", "--yes"]) == exit_codes.OK
    assert "old-pi" in capsys.readouterr().out
    assert not (left.prefix / "opt/swarm/newswarm").exists()
    assert journal.left(journal.folder("newswarm"), ()) == []
    assert run(["remove", str(leader_spec), "--orphans", "--yes"]) == exit_codes.OK
    assert "no host has left the spec" in capsys.readouterr().out


@pytest.mark.usefixtures("left")
def test_one_whose_address_is_not_known_is_named(
    leader_spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    journal.remember(journal.folder("newswarm"), "old-pi", "0" * 16, {})
    assert run(["remove", str(leader_spec), "--orphans", "--yes"]) == exit_codes.ERROR
    assert "host old-pi is no longer in the spec, and where it is reached is not known" in (
        capsys.readouterr().err
    )


def test_limit_chooses_among_the_hosts_that_left(
    left: FakeHost, leader_spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = journal.folder("newswarm")
    journal.remember(place, "dead-pi", "0" * 16, {}, LOGIN._replace(address="192.0.2.8"))
    orphans = ["remove", str(leader_spec), "--orphans", "--yes", "--limit"]
    assert run([*orphans, "k3-pi"]) == exit_codes.ERROR  # it is in the spec
    assert "dead-pi" in capsys.readouterr().err
    assert run([*orphans, "old-pi"]) == exit_codes.OK
    assert not (left.prefix / "opt/swarm/newswarm").exists()
    assert journal.left(place, ()) == ["dead-pi"]


def test_a_host_that_is_gone_for_good_is_forgotten(
    left: FakeHost, leader_spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = journal.folder("newswarm")
    forget = ["remove", str(leader_spec), "--orphans", "--forget", "--limit", "old-pi"]
    assert run(forget[:-2]) == exit_codes.USAGE
    assert run(forget) == exit_codes.ERROR  # without an answer
    assert "nothing was forgotten" in capsys.readouterr().err
    assert journal.left(place, ()) == ["old-pi"]
    assert run([*forget, "--yes"]) == exit_codes.OK
    assert "old-pi  forgotten; whatever it has is still there" in capsys.readouterr().out
    assert journal.left(place, ()) == []
    assert (left.prefix / "opt/swarm/newswarm/releases").exists()


@pytest.fixture
def named(tmp_path: Path, left: FakeHost, elsewhere: dict[str, FakeHost], leader_spec: Path) -> Path:
    """A spec beside which a key of old-pi is pinned; this machine never deployed, and k3-pi names old-pi."""
    journal.forget(journal.folder("newswarm"), "old-pi")
    elsewhere["k3-pi"] = host = fake(tmp_path / "k3-pi")
    (host.prefix / "opt/swarm/newswarm/state").mkdir()
    (host.prefix / HOST_LIST).write_text(
        json.dumps({"epoch": 5, "hosts": {"old-pi": LOGIN._asdict()}, "gone": {}})
    )
    spec = tmp_path / "swarm.yaml"
    spec.write_bytes(leader_spec.read_bytes())
    key = "ssh-ed25519 AAAAC3NzaC1lZDI1NTE5AAAAIOMqqnkVzrm0SdG6UOoqKLsabgH5C9okWi0dh2l9GKJl"
    spec.with_name("swarm.known_hosts").write_text(f"old-pi,[192.0.2.7]:2222 {key}\n")
    return spec


def test_a_host_that_only_others_name_needs_the_operators_word(
    named: Path, left: FakeHost, elsewhere: dict[str, FakeHost], capsys: pytest.CaptureFixture[str]
) -> None:
    orphans = ["remove", str(named), "--orphans", "--yes"]
    assert run(orphans) == exit_codes.ERROR
    error = " ".join(capsys.readouterr().err.split())
    assert "only the list of k3-pi says that it is ann@192.0.2.7 port 2222; if that is right" in error
    assert (left.prefix / "opt/swarm/newswarm").exists()
    assert run([*orphans, "--limit", "old-pi"]) == exit_codes.OK
    assert not (left.prefix / "opt/swarm/newswarm").exists()
    stored = json.loads(elsewhere["k3-pi"].read(HOST_LIST))
    assert (stored["hosts"].keys(), stored["gone"].keys()) == (set(), {"old-pi"})
    assert run(orphans) == exit_codes.OK
    assert "no host has left the spec" in capsys.readouterr().out


def test_no_host_that_others_name_is_contacted_without_its_key(
    named: Path, left: FakeHost, capsys: pytest.CaptureFixture[str]
) -> None:
    pins = named.with_name("swarm.known_hosts")
    pins.write_text(pins.read_text().replace("old-pi,", ""))  # a key of its address alone is no proof
    assert run(["remove", str(named), "--orphans", "--yes", "--limit", "old-pi"]) == exit_codes.ERROR
    assert "no key is pinned for its name" in " ".join(capsys.readouterr().err.split())
    assert (left.prefix / "opt/swarm/newswarm").exists()


def test_plan_shows_it_and_a_forgotten_one_is_in_the_history(
    named: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run(["plan", str(named), "--json"])
    assert json.loads(capsys.readouterr().out)["left_hosts"] == ["old-pi"]
    run(["plan", str(named)])
    error = " ".join(capsys.readouterr().err.split())
    assert "host old-pi (ann@192.0.2.7 port 2222, in the list of k3-pi) is no longer in the spec" in error
    forget = ["remove", str(named), "--orphans", "--forget", "--yes", "--limit", "old-pi"]
    assert run(forget) == exit_codes.OK
    capsys.readouterr()
    run(["history", str(named)])
    assert "k3-pi  forgot old-pi" in capsys.readouterr().out
    run(["plan", str(named), "--json"])
    assert json.loads(capsys.readouterr().out)["left_hosts"] == []


@pytest.mark.parametrize("text", ['{"address": 1}', "3", '{"login": {"address": "x"}}', "{"])
def test_a_damaged_journal_has_no_login(tmp_path: Path, text: str) -> None:
    (tmp_path / "pi.json").write_text(text)
    assert journal.login_of(tmp_path, "pi") is None
