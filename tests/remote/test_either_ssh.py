"""Paramiko, and the program ``ssh`` where paramiko cannot: when it is used, and when it must not be."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import paramiko
import pytest
import typer

from swarmctl.cli import ssh_targets
from swarmctl.remote import either_ssh
from swarmctl.remote.either_ssh import Choice, EitherSsh
from swarmctl.remote.identities import Keyring
from swarmctl.remote.openssh import OpenSshTransport
from swarmctl.remote.transport import HostError, Kind, Target
from tests.remote import sshd as servers
from tests.remote.conftest import NOWHERE
from tests.remote.sshd import Sshd

pytestmark = pytest.mark.skipif(not shutil.which("ssh"), reason="needs ssh (apt install openssh-client)")


def either(notes: list[str], home: Path = NOWHERE, choice: Choice = Choice.EITHER) -> EitherSsh:
    return EitherSsh(choice, Keyring(home, use_agent=False), note=notes.append)


@contextmanager
def certified(folder: Path) -> Iterator[tuple[Sshd, Path]]:
    """A server that lets in whom its authority has certified, and a ``.ssh`` that names a certificate."""
    folder.mkdir()
    servers.make_key(folder / "ca")
    extra = f"TrustedUserCAKeys {folder}/ca.pub"
    with servers.running(folder / "sshd", authorize=False, extra=extra) as server:
        sign = ["ssh-keygen", "-q", "-s", str(folder / "ca"), "-I", "anna", "-n", "root"]
        (folder / "ssh").mkdir()
        shutil.copy(folder / "sshd/id.pub", folder / "ssh/lab.pub")
        subprocess.run([*sign, str(folder / "ssh/lab.pub")], check=True)
        (folder / "ssh/config").write_text(f"Host pi*\n CertificateFile {folder}/ssh/lab-cert.pub\n")
        yield server, folder / "ssh"


CERTIFICATE = {"ssh_only": ("CertificateFile",)}


@pytest.mark.parametrize(
    "extra",
    [
        "KexAlgorithms sntrup761x25519-sha512@openssh.com",
        "KexAlgorithms diffie-hellman-group18-sha512",
        "Ciphers chacha20-poly1305@openssh.com",
        "Ciphers aes128-ctr\nMACs umac-128-etm@openssh.com",
    ],
)
def test_a_host_with_algorithms_that_paramiko_lacks_is_reached(spare: Path, extra: str) -> None:
    notes: list[str] = []
    with servers.running(spare, extra=extra) as server:
        transport = either(notes)
        for _ in range(2):
            with transport.connect(server.target()) as session:
                assert servers.run(session, "echo hello").stdout == b"hello\n"
        assert server.log.count("Unable to negotiate") == 1, "paramiko is tried once"
    assert notes == [
        "pi is reached with the program `ssh`: paramiko has none of the algorithms that it offers"
    ]


def test_a_certificate_logs_in(spare: Path) -> None:
    notes: list[str] = []
    with (
        certified(spare) as (server, home),
        either(notes, home).connect(server.target(**CERTIFICATE)) as session,
    ):
        assert servers.run(session, "echo hello").stdout == b"hello\n"
    assert notes == ["pi is reached with the program `ssh`: `CertificateFile` in ~/.ssh/config"]


@pytest.mark.parametrize("authorize", [True, False], ids=["key", "certificate"])
def test_a_key_with_a_certificate_beside_it_logs_in_as_either(spare: Path, authorize: bool) -> None:
    spare.mkdir()
    servers.make_key(spare / "ca")
    extra = "" if authorize else f"TrustedUserCAKeys {spare}/ca.pub"
    with servers.running(spare / "sshd", authorize=authorize, extra=extra) as server:
        sign = ["ssh-keygen", "-q", "-s", str(spare / "ca"), "-I", "anna", "-n", "root"]
        subprocess.run([*sign, str(spare / "sshd/id.pub")], check=True)
        with either([]).connect(server.target()) as session:
            assert servers.run(session, "echo hello").stdout == b"hello\n"


def test_of_many_hosts_one_note_is_made(spare: Path) -> None:
    notes: list[str] = []
    with certified(spare) as (server, home):
        transport = either(notes, home)
        for name in ("pi-1", "pi-2", "pi-3"):
            with transport.connect(server.target(host=name, **CERTIFICATE)):
                pass
    assert len(notes) == 1


def never(monkeypatch: pytest.MonkeyPatch) -> None:
    def used(*_: object, **__: object) -> None:
        raise AssertionError("the program ssh is used")

    monkeypatch.setattr(OpenSshTransport, "__init__", used)


def wrong_key(server: Sshd, other: str) -> Target:
    return server.target(keys=(other,))


def no_key(server: Sshd, other: str) -> Target:
    return server.target(keys=())


def revoked_key(server: Sshd, other: str) -> Target:
    return server.target(revoked=server.keys)


@pytest.mark.parametrize("changed", [wrong_key, no_key, revoked_key])
def test_a_wrong_host_key_is_final(
    spare: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, changed: Callable[[Sshd, str], Target]
) -> None:
    never(monkeypatch)
    other = servers.make_key(tmp_path / "other")
    with (
        certified(spare) as (server, home),
        pytest.raises(HostError) as caught,
        either([], home).connect(replace(changed(server, other), **CERTIFICATE)),
    ):
        pass
    assert caught.value.kind is Kind.HOST_KEY


@pytest.mark.parametrize("jump", [False, True], ids=["itself", "through it"])
@pytest.mark.parametrize("choice", Choice)
def test_nobody_logs_in_to_an_expelled_host(sshd: Sshd, choice: Choice, jump: bool) -> None:
    """A thief would get the password of sudo."""
    lost = replace(sshd.target(), expelled=True)
    target = sshd.target(host="behind", jump=lost) if jump else lost
    with pytest.raises(HostError, match="was expelled from the swarm") as refusal:
        either([], choice=choice).connect(target).__enter__()
    assert refusal.value.kind is Kind.UNREACHABLE


def test_a_wrong_signature_of_the_host_is_final(sshd: Sshd, monkeypatch: pytest.MonkeyPatch) -> None:
    never(monkeypatch)
    monkeypatch.setattr(paramiko.Ed25519Key, "verify_ssh_sig", lambda *_: False)
    with pytest.raises(HostError) as caught, either([]).connect(sshd.target(keys=sshd.keys[2:])):
        pass
    assert caught.value.kind is Kind.UNREACHABLE
    assert "Signature verification" in caught.value.message


def test_a_rejected_key_is_final_if_ssh_has_no_other(spare: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    never(monkeypatch)
    with servers.running(spare, authorize=False) as server:
        with pytest.raises(HostError) as caught, either([]).connect(server.target()):
            pass
        assert server.log.count("Connection from") == 1
    assert caught.value.kind is Kind.AUTH


@pytest.mark.parametrize("option", ["CertificateFile", "PKCS11Provider", "GSSAPIAuthentication"])
def test_a_rejected_key_is_tried_by_ssh_if_the_config_names_more(spare: Path, option: str) -> None:
    notes: list[str] = []
    with (
        servers.running(spare, authorize=False) as server,
        pytest.raises(HostError) as caught,
        either(notes).connect(server.target(ssh_only=(option,))),
    ):
        pass
    assert caught.value.kind is Kind.AUTH
    assert notes == [f"pi is reached with the program `ssh`: `{option}` in ~/.ssh/config"]


def test_a_security_key_is_left_to_ssh(tmp_path: Path) -> None:
    (tmp_path / "id_ed25519_sk").write_text("no hardware here\n")
    (tmp_path / "id_ed25519_sk.pub").write_text("sk-ssh-ed25519@openssh.com AAAA anna\n")
    keyring = Keyring(tmp_path, use_agent=False)
    expected = f"the key {tmp_path}/id_ed25519_sk is on a security key"
    assert keyring.beyond_paramiko(()) == keyring.beyond_paramiko((tmp_path / "id_ed25519_sk",)) == expected
    assert keyring.beyond_paramiko((tmp_path / "other",)) == ""


@pytest.mark.parametrize("choice", [Choice.PARAMIKO, Choice.OPENSSH])
def test_a_choice_is_followed(spare: Path, monkeypatch: pytest.MonkeyPatch, choice: Choice) -> None:
    monkeypatch.setenv(either_ssh.VARIABLE, choice.value)
    with certified(spare) as (server, home):
        try:
            with either([], home, either_ssh.chosen()).connect(server.target(**CERTIFICATE)):
                accepted = True
        except HostError:
            accepted = False
    assert accepted is (choice is Choice.OPENSSH)


def test_a_choice_that_does_not_exist_ends_the_command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(either_ssh.VARIABLE, "putty")
    with pytest.raises(typer.Exit):
        ssh_targets.transport()
    printed = " ".join(capsys.readouterr().err.split())
    assert "SWARMCTL_SSH=putty: it is one of auto, paramiko, openssh" in printed


def test_without_ssh_paramikos_error_names_it(spare: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with certified(spare) as (server, home), monkeypatch.context() as patch:
        patch.setenv("PATH", "/nowhere")
        with pytest.raises(HostError) as caught, either([], home).connect(server.target(**CERTIFICATE)):
            pass
    assert "rejected the login" in caught.value.message
    assert "apt install openssh-client" in caught.value.hint


def test_a_key_is_read_from_a_host_that_only_ssh_reaches(spare: Path, tmp_path: Path) -> None:
    only = "KexAlgorithms sntrup761x25519-sha512@openssh.com"
    notes: list[str] = []
    with (
        servers.running(spare, kinds=("ecdsa", "ed25519"), extra=only) as server,
        servers.running(tmp_path / "gate", extra=only) as gate,
    ):
        for target in (server.target(keys=()), server.target(keys=(), jump=gate.target(host="gate"))):
            assert either(notes).scan(target) == server.keys[1]
        with pytest.raises(HostError) as caught:
            either(notes).scan(server.target(keys=(), jump=gate.target(host="gate", keys=server.keys)))
        assert caught.value.message.startswith("gate ")
        assert "userauth" not in server.log
        assert either(notes).scan(server.target(keys=server.keys[:1])) == server.keys[0], "a known type first"
    assert caught.value.kind is Kind.HOST_KEY
