"""Lost packets are counted by ping, beside other work; a host without ping has no counts."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from swarm_onboard.agent import pings
from swarm_onboard.agent.pings import Pings

HERE = "127.0.0.1"


def program(folder: Path, text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A ``ping`` that does ``text``, a shell script."""
    (folder / "ping").write_text(f"#!/bin/sh\n{text}\n")
    (folder / "ping").chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder}:{os.environ['PATH']}")


@pytest.mark.parametrize("words", ["7 received, 3 duplicates", "7 packets received"])
def test_losses_are_counted_by_any_ping(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: str) -> None:
    program(tmp_path, f"echo 'PING'; echo '10 packets transmitted, {words}, 30% packet loss'", monkeypatch)
    assert Pings({HERE: 0.2}).counts() == {HERE: (10, 7)}


@pytest.mark.parametrize("text", ["exit 2", "echo nonsense", "exec sleep 3600"])
def test_a_ping_that_fails_or_hangs_has_no_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str
) -> None:
    monkeypatch.setattr(pings, "_PATIENCE", -0.9)
    program(tmp_path, text, monkeypatch)
    assert Pings({HERE: 0.1}).counts() == {}


def test_a_host_without_ping_has_no_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pings, "plain_environment", lambda: {"PATH": "/nowhere"})
    monkeypatch.setenv("PATH", "/nowhere")
    assert Pings({HERE: 0.1}).counts() == {}
