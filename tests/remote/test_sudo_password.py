"""Accounts that become root with a password only: a real sshd, a real sudo and PAM."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
import typer

from swarmctl.cli import ssh_targets
from swarmctl.remote import agent_client
from swarmctl.remote.sudo_password import SudoPassword, from_file
from swarmctl.remote.transport import HostError, Kind
from tests.remote import sshd as servers
from tests.remote.conftest import MakeTransport, with_paramiko
from tests.remote.sshd import Sshd

OBSERVE = {"verb": "observe", "swarm": "new"}
PASSWORD = "päss \"w$rd' \\n% x"
# Files of the host that only this sshd and its children see.
MOUNT = 'for f in passwd shadow sudoers; do mount --bind "$0/$f" "/etc/$f" || exit; done; exec "$@"'


@pytest.fixture(scope="module")
def host() -> Iterator[Sshd]:
    """A host with the account ``robot``, for which sudo wants a password."""
    tools = ("sudo", "unshare", "openssl")
    if lacking := servers.missing() or " ".join(tool for tool in tools if not shutil.which(tool)):
        pytest.skip(f"needs {lacking}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o755)
        for part in ("opt", "etc", "run/systemd/system", "bin", "home"):
            (folder / "host" / part).mkdir(parents=True)
        (folder / "host/bin/systemctl").write_text("#!/bin/sh\n")
        (folder / "host/bin/systemctl").chmod(0o755)
        argv = ["openssl", "passwd", "-6", "-stdin"]
        digest = subprocess.run(
            argv, input=PASSWORD.encode(), capture_output=True, check=True
        ).stdout.decode()
        passwd, shadow = Path("/etc/passwd").read_text(), Path("/etc/shadow").read_text()
        (folder / "passwd").write_text(f"{passwd}robot:x:54321:54321::/tmp:/bin/sh\n")
        (folder / "shadow").write_text(f"{shadow}robot:{digest.strip()}:19000:0:99999:7:::\n")
        (folder / "shadow").chmod(0o600)
        (folder / "sudoers").write_text(
            'root ALL=(ALL) ALL\nrobot ALL=(ALL) ALL\nDefaults env_keep += "SWARM_PREFIX PATH HOME"\n'
        )
        (folder / "sudoers").chmod(0o440)
        within = ("unshare", "--mount", "sh", "-c", MOUNT, name)
        extra = (
            f"SetEnv SWARM_PREFIX={folder}/host PATH={folder}/host/bin:/usr/bin:/bin HOME={folder}/host/home"
        )
        (folder / "sshd").mkdir()
        (folder / "sshd").chmod(0o755)
        with servers.running(folder / "sshd", extra=extra, within=within) as server:
            yield server


def observed(
    host: Sshd, sudo: SudoPassword | None, user: str = "robot", make: MakeTransport = with_paramiko
) -> dict[str, object]:
    transport = make(sudo=sudo)
    with transport.connect(host.target(user=user)) as session, agent_client.agent_session(session) as agent:
        first = agent.request(OBSERVE)
        assert agent.request(OBSERVE).keys() == first.keys()
        return first  # type: ignore[no-any-return]


def test_with_its_password_an_account_becomes_root(host: Sshd, make: MakeTransport) -> None:
    assert observed(host, SudoPassword(PASSWORD), make=make)
    kept = [path for path in (host.folder.parent / "host/opt").rglob("*") if path.is_file()]
    assert kept
    assert {path.stat().st_uid for path in kept} == {0}


def test_root_is_sent_no_password(host: Sshd) -> None:
    assert observed(host, SudoPassword("root needs none"), user="root")


def test_a_wrong_password_is_sent_once_and_named(host: Sshd) -> None:
    wrong = SudoPassword("wrong")
    errors = []
    for _ in range(2):
        with pytest.raises(HostError) as caught:
            observed(host, wrong)
        errors.append(caught.value)

    assert [error.kind for error in errors] == [Kind.PRIVILEGE] * 2
    assert "rejects the password: sudo: 1 incorrect password attempt" in errors[0].message
    assert "a password is required" in errors[1].message  # without another attempt
    assert "SWARMCTL_SUDO_PASSWORD_FILE" in errors[1].hint


def test_the_password_is_in_no_command_and_no_log(host: Sshd, monkeypatch: pytest.MonkeyPatch) -> None:
    commands = []
    original = agent_client.command
    monkeypatch.setattr(
        agent_client, "command", lambda *a, **k: commands.append(original(*a, **k)) or commands[-1]
    )
    sudo = SudoPassword(PASSWORD)
    observed(host, sudo)

    assert commands
    assert PASSWORD not in "".join([*commands, host.log, repr(sudo), str(vars(sudo).keys())])


@pytest.mark.parametrize("content", ["", "\n", "x" * 2000])
def test_a_file_without_a_password_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "secret").write_text(content)
    with pytest.raises(ValueError, match="one line"):
        from_file(tmp_path / "secret", 1.0)


def test_a_pipe_to_which_nobody_writes_is_given_up_on(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(TimeoutError, match="nobody writes to this pipe"):
        from_file(tmp_path / "pipe", 0.2)


@pytest.mark.parametrize("wrong", ["absent", "pipe"])
def test_a_stop_goes_on_without_the_password(
    tmp_path: Path, wrong: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    os.mkfifo(tmp_path / "pipe")
    monkeypatch.setenv(ssh_targets.SUDO_PASSWORD_FILE, str(tmp_path / wrong))
    assert ssh_targets.transport(urgent=True) is not None
    assert "going on without a password" in " ".join(capsys.readouterr().err.split())


def test_a_wrong_password_file_ends_the_command_with_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(ssh_targets.SUDO_PASSWORD_FILE, str(tmp_path / "absent"))
    with pytest.raises(typer.Exit):
        ssh_targets.transport()
    printed = " ".join(capsys.readouterr().err.split())
    assert "absent: No such file or directory" in printed
    assert "first line is the password" in printed


def test_a_pipe_is_read_once_for_all_connections_of_a_command(
    monkeypatch: pytest.MonkeyPatch, host: Sshd
) -> None:
    read, write = os.pipe()
    os.write(write, f"{PASSWORD}\n".encode())
    os.close(write)
    monkeypatch.setenv(ssh_targets.SUDO_PASSWORD_FILE, f"/dev/fd/{read}")
    try:
        for _ in range(2):
            with (
                ssh_targets.transport().connect(host.target(user="robot")) as session,
                agent_client.agent_session(session) as agent,
            ):
                assert agent.request(OBSERVE)
    finally:
        os.close(read)


def test_the_login_that_confirms_a_change_becomes_root(host: Sshd, make: MakeTransport) -> None:
    def became(user: str, sudo: SudoPassword | None) -> HostError | None:
        try:
            with make(sudo=sudo).connect(host.target(user=user)) as session:
                agent_client.become_root(session)
        except HostError as error:
            return error
        return None

    assert became("root", None) is None
    assert became("robot", SudoPassword(PASSWORD)) is None
    without = became("robot", None)
    assert without is not None
    assert without.kind is Kind.PRIVILEGE
    assert "NOPASSWD" in without.hint

    sudoers = host.folder.parent / "sudoers"
    rules = sudoers.read_text()
    sudoers.write_text(rules.replace("robot ALL", "# robot ALL"))
    try:
        locked_out = became("robot", SudoPassword(PASSWORD))
    finally:
        sudoers.write_text(rules)
    assert locked_out is not None
    assert locked_out.kind is Kind.PRIVILEGE
    assert "as root" in locked_out.message


def test_an_account_that_needs_a_terminal_for_sudo_lacks_a_rule(host: Sshd) -> None:
    sudoers = host.folder.parent / "sudoers"
    rules = sudoers.read_text()
    sudoers.write_text(f"{rules}robot ALL=(ALL) NOPASSWD: ALL\nDefaults requiretty\n")
    try:
        with pytest.raises(HostError) as caught:
            observed(host, None)
        assert "`Defaults !requiretty`" in caught.value.hint
        sudoers.write_text(f"{sudoers.read_text()}Defaults !requiretty\n")
        assert observed(host, None)
    finally:
        sudoers.write_text(rules)
