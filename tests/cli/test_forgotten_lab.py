"""A forgotten ``--lab`` is guessed at when the hosts do not answer and a lab of their swarm runs."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.cli.where import Where
from swarmctl.lab import lab_state, supervisor_client
from swarmctl.remote.ssh import SshTransport
from swarmctl.remote.transport import HostError, Kind, Target


@pytest.fixture
def silent_hosts(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """No host answers, and there is a folder of a lab."""

    def connect(*_: Any, **__: Any) -> None:
        raise HostError(Kind.UNREACHABLE, "no answer", "is the host switched on?")

    targets = {name: Target(name, "192.0.2.1", "robot") for name in ("koala-laptop", "k3-pi", "epuck-pi")}
    monkeypatch.setattr(Where, "targets", lambda *_, **__: targets)
    monkeypatch.setattr(SshTransport, "connect", connect)
    monkeypatch.setenv("SWARMCTL_STATE", str(tmp_path / "state"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "journal"))
    (tmp_path / "state/lab/second").mkdir(parents=True)


def lab_of(swarm: str, monkeypatch: pytest.MonkeyPatch, *, runs: bool = True) -> None:
    state = SimpleNamespace(plan=SimpleNamespace(swarm=swarm))
    monkeypatch.setattr(lab_state, "read_state", lambda _: state)
    monkeypatch.setattr(supervisor_client, "status", lambda _: {} if runs else None)


@pytest.mark.usefixtures("silent_hosts")
@pytest.mark.parametrize("verb", [["plan"], ["deploy"], ["status"], ["remove", "--yes"]])
def test_the_command_with_lab_is_named(
    verb: list[str], leader_spec: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lab_of("newswarm", monkeypatch)
    assert run([*verb, str(leader_spec)]) == exit_codes.HOSTS_UNREACHABLE
    assert f"`swarmctl {verb[0]} {leader_spec} --lab-name second`" in capsys.readouterr().err


@pytest.mark.usefixtures("silent_hosts")
@pytest.mark.parametrize(("swarm", "runs"), [("another", True), ("newswarm", False)])
def test_other_labs_are_not_named(
    swarm: str,
    runs: bool,
    leader_spec: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    lab_of(swarm, monkeypatch, runs=runs)
    assert run(["plan", str(leader_spec)]) == exit_codes.HOSTS_UNREACHABLE
    assert "--lab" not in capsys.readouterr().err
