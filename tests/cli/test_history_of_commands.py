"""``history --commands``: who drove, as hosts recorded it; a record that was changed is an error."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest
from swarm_onboard.command.authority import Sender
from swarm_onboard.command.command_log import CommandLog
from swarm_onboard.common.record_chain import FILE, OLDER

from swarmctl.cli import exit_codes, ssh_targets
from swarmctl.cli.app import run
from swarmctl.cli.ssh_targets import NamedHosts
from swarmctl.cli.where import Where
from swarmctl.deploy import journal
from swarmctl.remote.transport import HostError, Kind, Session, Target
from tests.cli.test_left_hosts import fake
from tests.onboard.agent.fakehost import FakeHost
from tests.onboard.agent.local_session import LocalSession

Read = Callable[..., int]


def drive(folder: Path, *nodes: str) -> None:
    """Nodes of the laptop command the robot whose record is in ``folder``, one after the other."""
    folder.mkdir(parents=True, exist_ok=True)
    log = CommandLog(folder, {"release": "r1", "commanders": ["laptop (priority 0)"]})
    for node in nodes:
        log.admitted("laptop", Sender(node, "10.0.0.1"))
    log.close()


@pytest.fixture
def host(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FakeHost:
    """The host k3-pi; others do not answer."""
    made = fake(tmp_path / "k3-pi")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "journal"))

    @contextmanager
    def connect(target: Target) -> Iterator[Session]:
        if target.host != "k3-pi":
            raise HostError(Kind.UNREACHABLE, f"no route to {target.host}")
        yield LocalSession(made.environment())

    class Transport:
        def __init__(self) -> None:
            self.connect = connect

    def targets(_spec: object, swarm: NamedHosts, **_: object) -> Mapping[str, Target]:
        return {one.name: Target(one.name, one.address, one.user, one.port) for one in swarm.hosts.values()}

    monkeypatch.setattr(Where, "targets", targets)
    monkeypatch.setattr(ssh_targets, "transport", Transport)
    return made


@pytest.fixture
def record(host: FakeHost) -> Path:
    """The folder of the record of k3."""
    folder = host.prefix / "var/lib/swarm-commands/newswarm/k3"
    drive(folder, "/joystick")
    return folder


@pytest.fixture
def read(leader_spec: Path, host: FakeHost) -> Read:
    """Reads the records of k3-pi. Returns the exit code."""
    return lambda *more: run(["history", str(leader_spec), "--commands", "--limit", "k3-pi", *more])


def printed(capsys: pytest.CaptureFixture[str]) -> str:
    return " ".join(capsys.readouterr().out.split())


@pytest.mark.usefixtures("record")
def test_it_lists_who_drove_and_what_it_is_proven_by(read: Read, capsys: pytest.CaptureFixture[str]) -> None:
    assert read() == exit_codes.OK
    text = printed(capsys)
    assert "k3 laptop (/joystick) 0 s k3-pi" in text
    assert "k3 starts with release r1; may command: laptop (priority 0) k3-pi" in text
    assert "k3 on k3-pi recorded since 20" in text
    assert text.endswith("3 entries, unchanged")

    assert read("--json") == exit_codes.OK
    found = json.loads(capsys.readouterr().out)
    assert [(one["event"], one["robot"]) for one in found["commands"]] == [
        ("started", "k3"),
        ("commanded", "k3"),
    ]
    assert [one["problem"] for one in found["records"]] == [""]


def test_a_record_that_grew_is_unchanged(
    record: Path, read: Read, capsys: pytest.CaptureFixture[str]
) -> None:
    assert read() == exit_codes.OK
    drive(record, "/joystick", "/\x1b[2J")
    capsys.readouterr()
    assert read() == exit_codes.OK
    text = capsys.readouterr().out
    assert "8 entries, unchanged" in text
    assert "\x1b[2J" not in text
    assert text.count("may command") == 1


@pytest.mark.parametrize("whole", [True, False])
def test_a_record_that_was_changed_is_named_until_the_head_is_deleted(
    record: Path, read: Read, capsys: pytest.CaptureFixture[str], whole: bool
) -> None:
    assert read() == exit_codes.OK
    if whole:
        (record / FILE).unlink()
        drive(record, "/other")
    else:
        record.rename(record.with_name("k4"))
    for _ in range(2):
        capsys.readouterr()
        assert read() == exit_codes.HOSTS_FAILED
        what = "entry 3 is another one" if whole else "it has 0 entries, and had 3"
        found = printed(capsys)
        assert f"k3 on k3-pi the record proves nothing: changed since you read it last: {what}" in found
    (journal.folder("newswarm") / ".commands-k3-pi.json").unlink()
    assert read() == exit_codes.OK


def test_an_edited_line_is_named_at_the_first_look(
    record: Path, read: Read, capsys: pytest.CaptureFixture[str]
) -> None:
    file = record / FILE
    file.write_text(file.read_text().replace("/joystick", "/wander", 1))
    assert read() == exit_codes.HOSTS_FAILED
    assert "entry 3 does not follow entry 2: lines were changed or removed" in printed(capsys)
    assert (journal.folder("newswarm") / ".commands-k3-pi.json").read_text() == "{}"


def test_the_agent_follows_no_link_of_the_drivers_account(
    record: Path, read: Read, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    secret = tmp_path / "secret"
    secret.write_text((record / FILE).read_text())
    (record / FILE).unlink()
    (record / FILE).symlink_to(secret)
    os.mkfifo(record / OLDER)
    assert read("--json") == exit_codes.OK
    assert json.loads(capsys.readouterr().out)["commands"] == []


def test_a_line_that_is_being_written_is_left_out(record: Path, read: Read) -> None:
    with (record / FILE).open("a") as file:
        file.write('{"number": 4, "prev')
    assert read() == exit_codes.OK


@pytest.mark.usefixtures("record")
def test_a_head_that_cannot_be_stored_is_an_error(read: Read, capsys: pytest.CaptureFixture[str]) -> None:
    journal.folder("newswarm").parent.mkdir(parents=True)
    journal.folder("newswarm").write_text("no folder")
    assert read() == exit_codes.ERROR
    found = capsys.readouterr()
    assert "3 entries, unchanged" in found.out
    assert "newswarm" in found.err


@pytest.mark.usefixtures("host")
def test_a_host_without_records_lists_nothing(read: Read, capsys: pytest.CaptureFixture[str]) -> None:
    assert read("--json") == exit_codes.OK
    assert json.loads(capsys.readouterr().out)["records"] == []
