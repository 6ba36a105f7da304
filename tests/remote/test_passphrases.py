"""A key with a passphrase: one prompt for it, on a terminal only, before any connection."""

from __future__ import annotations

import getpass
import sys
from pathlib import Path

import pytest

from swarmctl.cli import ssh_targets
from swarmctl.remote.transport import Target
from tests.remote import sshd as servers

SPOKEN = "open sesame"


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("SSH_AUTH_SOCK", raising=False)
    (tmp_path / ".ssh").mkdir()
    return tmp_path


def typed(monkeypatch: pytest.MonkeyPatch, *answers: str, terminal: bool = True) -> list[str]:
    """A person at a terminal, or none; returns the prompts."""
    prompts: list[str] = []
    left = list(answers)

    def ask(prompt: str) -> str:
        prompts.append(prompt)
        return left.pop(0)

    monkeypatch.setattr(getpass, "getpass", ask)
    for stream in (sys.stdin, sys.stderr):
        monkeypatch.setattr(stream, "isatty", lambda: terminal, raising=False)
    return prompts


def test_one_prompt_suffices_to_log_in(
    home: Path, spare: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    prompts = typed(monkeypatch, "wrong", SPOKEN)
    with servers.running(spare, kinds=("ed25519",)) as server:
        locked = home / "locked"
        public = servers.make_key(locked, passphrase=SPOKEN)
        (spare / "authorized").write_text(public + "\n")
        ways = [server.target(identities=(locked,)), Target("pi", "10.0.0.1", "robot", identities=(locked,))]
        for _ in range(2):
            ssh_targets.ask_passphrases(ways)
        with ssh_targets.transport().connect(ways[0]):
            pass
    assert prompts == [f"Passphrase of {locked}: "] * 2
    assert f"this is not the passphrase of {locked}" in "".join(capsys.readouterr().err.splitlines())


def test_keys_of_jump_hosts_and_default_keys_have_prompts(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    servers.make_key(home / "gate", passphrase=SPOKEN)
    servers.make_key(home / ".ssh/id_ed25519", passphrase=SPOKEN)
    prompts = typed(monkeypatch, SPOKEN, SPOKEN)
    hop = Target("gate", "10.0.0.1", "robot", identities=(home / "gate",))
    ssh_targets.ask_passphrases([Target("pi", "10.0.0.2", "robot", jump=hop)])
    assert sorted(prompts) == [f"Passphrase of {home / name}: " for name in (".ssh/id_ed25519", "gate")]


def test_an_empty_answer_leaves_the_key_out(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    servers.make_key(home / "locked", passphrase=SPOKEN)
    prompts = typed(monkeypatch, "")
    for _ in range(2):
        ssh_targets.ask_passphrases([Target("pi", "10.0.0.1", "robot", identities=(home / "locked",))])
    assert len(prompts) == 1


def test_nobody_is_asked_without_a_terminal(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    servers.make_key(home / "locked", passphrase=SPOKEN)
    prompts = typed(monkeypatch, terminal=False)
    ssh_targets.ask_passphrases([Target("pi", "10.0.0.1", "robot", identities=(home / "locked",))])
    assert prompts == []
