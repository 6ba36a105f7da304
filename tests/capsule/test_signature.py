"""A capsule is signed with a key of SSH, by the real ssh-keygen; any other index does not fit it."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from swarmctl.capsule.capsule_index import INDEX, SIGNATURE
from swarmctl.capsule.folder import problems, write
from swarmctl.capsule.signature import Signer, sign, signer
from tests.capsule.trial_folder import ABOUT, edit, filled
from tests.timing import wait_for


def made(key: Path, passphrase: str = "") -> Path:
    subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", passphrase, "-f", key], check=True)
    return key


@pytest.fixture
def key(tmp_path: Path) -> Path:
    return made(tmp_path / "key")


@pytest.fixture
def capsule(tmp_path: Path) -> Path:
    folder = filled(tmp_path / "-circle")
    write(folder, ABOUT)
    return folder


def fingerprint(key: Path) -> str:
    listed = subprocess.run(["ssh-keygen", "-lf", key], capture_output=True, text=True, check=True)
    return listed.stdout.split()[1]


def test_the_signer_is_known_by_the_fingerprint(capsule: Path, key: Path) -> None:
    assert signer(capsule) == Signer()
    assert sign(capsule, key) == ""
    assert signer(capsule) == Signer(fingerprint(key))
    assert problems(capsule) == ()


def test_a_key_in_an_agent_signs(
    capsule: Path, key: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    socket = tmp_path / "agent"
    monkeypatch.setenv("SSH_AUTH_SOCK", str(socket))
    with subprocess.Popen(["ssh-agent", "-D", "-a", socket], stdout=subprocess.DEVNULL) as agent:
        try:
            wait_for(socket.exists)
            subprocess.run(["ssh-add", "-q", key], check=True)
            key.unlink()
            assert sign(capsule, key.with_suffix(".pub")) == ""
        finally:
            agent.terminate()
    assert signer(capsule).fingerprint == fingerprint(key.with_suffix(".pub"))


def test_a_second_signature_replaces_the_first(capsule: Path, key: Path, tmp_path: Path) -> None:
    (capsule / SIGNATURE).symlink_to(tmp_path / "elsewhere")
    other = made(tmp_path / "other")
    assert (sign(capsule, key), sign(capsule, other)) == ("", "")
    assert signer(capsule).fingerprint == fingerprint(other)
    assert not (tmp_path / "elsewhere").exists()


def test_another_index_does_not_fit(capsule: Path, key: Path) -> None:
    sign(capsule, key)
    edit(capsule, lambda index: index.update(outcome="failed"))
    found = signer(capsule)
    assert found.fingerprint == ""
    assert found.problem.startswith(f"{SIGNATURE} does not fit (")


def test_a_signature_of_something_else_does_not_fit(capsule: Path, key: Path) -> None:
    data = (capsule / INDEX).read_bytes()
    ran = subprocess.run(
        ["ssh-keygen", "-Y", "sign", "-f", key, "-n", "file"], input=data, capture_output=True, check=True
    )
    (capsule / SIGNATURE).write_bytes(ran.stdout)
    assert signer(capsule).problem


@pytest.mark.parametrize("content", [b"", b"\x1b[2J", b"-----BEGIN SSH SIGNATURE-----\nAAAA\n"])
def test_what_is_no_signature_is_a_problem(capsule: Path, content: bytes) -> None:
    (capsule / SIGNATURE).write_bytes(content)
    found = signer(capsule)
    assert found.fingerprint == ""
    assert found.problem.isprintable()
    assert found.problem


@pytest.mark.parametrize("target", ["missing", "signature"])
def test_a_linked_signature_is_a_problem(capsule: Path, key: Path, tmp_path: Path, target: str) -> None:
    sign(capsule, key)
    (capsule / SIGNATURE).rename(tmp_path / "signature")
    (capsule / SIGNATURE).symlink_to(tmp_path / target)
    assert signer(capsule) == Signer(problem=f"{SIGNATURE} is not a file")


def test_a_key_that_cannot_sign_is_a_reason(
    capsule: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("DISPLAY", "SSH_ASKPASS", "SSH_AUTH_SOCK"):
        monkeypatch.delenv(name, raising=False)
    assert "No such file" in sign(capsule, tmp_path / "none")
    locked = made(tmp_path / "locked", "a passphrase")
    why = sign(capsule, locked)
    assert "incorrect passphrase" in why
    assert "Enter" not in why  # nobody is there to type it
    locked.unlink()
    assert sign(capsule, locked.with_suffix(".pub")).startswith(f"{locked}.pub did not sign it: ")
    assert signer(capsule) == Signer()


def test_without_ssh_keygen_there_is_a_reason(
    capsule: Path, key: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sign(capsule, key)
    monkeypatch.setenv("PATH", str(capsule))
    assert "cannot run ssh-keygen" in sign(capsule, key)
    assert "cannot run ssh-keygen" in signer(capsule).problem
