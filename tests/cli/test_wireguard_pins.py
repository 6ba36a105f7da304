"""`swarmctl trust` in a sealed swarm: public keys of WireGuard are pinned, and none is replaced silently."""

from __future__ import annotations

import base64
from collections.abc import Collection, Mapping
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes, options
from swarmctl.cli.verbs import trust
from swarmctl.deploy import public_keys
from swarmctl.lab import paths
from swarmctl.remote.transport import HostError, Kind, Target
from swarmctl.spec.wireguard_keys import parse
from tests import ROOT, in_process

HOSTS = ("koala-laptop", "k3-pi", "epuck-pi")


def key(number: int) -> str:
    return base64.b64encode(bytes([number]) * 32).decode()


class Answers:
    """What the hosts give in place of SSH."""

    def __init__(self) -> None:
        self.by_host: dict[str, str | HostError] = {name: key(number) for number, name in enumerate(HOSTS)}

    def public_keys(
        self, _swarm: str, targets: Collection[Target], _transport: object
    ) -> Mapping[str, str | HostError]:
        return {one.host: self.by_host[one.host] for one in targets}


@pytest.fixture
def answers(monkeypatch: pytest.MonkeyPatch) -> Answers:
    made = Answers()
    targets = {name: Target(name, "192.168.77.1", "robot", 22, (), ()) for name in HOSTS}
    monkeypatch.setattr(public_keys, "public_keys", made.public_keys)
    monkeypatch.setattr(options, "targets", lambda *_, **__: targets)
    monkeypatch.setattr(
        trust, "_pin_ssh", lambda _spec, swarm, host, **__: (host or list(swarm.hosts), {}, [])
    )
    return made


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    path = tmp_path / "lab.yaml"
    text = (ROOT / "examples/paper-leader/swarm.yaml").read_text("utf-8")
    path.write_text(f"{text}security: sealed\n", "utf-8")
    return path


def pinned(spec: Path) -> Mapping[str, str]:
    return parse(spec.with_name("newswarm.wireguard").read_bytes())


def test_new_keys_are_pinned_beside_the_spec(answers: Answers, spec: Path) -> None:
    done = in_process.swarmctl("trust", str(spec))
    assert done.returncode == 0, done.stderr
    assert pinned(spec) == answers.by_host
    again = in_process.swarmctl("trust", str(spec))
    assert (again.returncode, "pinned" in again.stdout) == (0, False)


def test_a_changed_key_is_pinned_only_when_it_is_named(answers: Answers, spec: Path) -> None:
    in_process.swarmctl("trust", str(spec))
    answers.by_host |= {"k3-pi": key(7), "epuck-pi": key(8)}
    refused = in_process.swarmctl("trust", str(spec))
    assert refused.returncode == exit_codes.ERROR
    assert "k3-pi, epuck-pi: the WireGuard key is another than the pinned one" in refused.stderr
    assert pinned(spec)["k3-pi"] == key(1)
    in_process.swarmctl("trust", str(spec), "--host", "k3-pi", "--replace")
    assert [pinned(spec)[host] for host in HOSTS] == [key(0), key(7), key(2)]


def test_a_file_that_cannot_be_read_is_not_replaced(answers: Answers, spec: Path) -> None:
    spec.with_name("newswarm.wireguard").mkdir()
    done = in_process.swarmctl("trust", str(spec))
    assert done.returncode == exit_codes.ERROR
    assert "newswarm.wireguard cannot be read: Is a directory" in done.stderr
    assert answers.by_host


def test_a_host_that_is_away_costs_only_itself(answers: Answers, spec: Path) -> None:
    answers.by_host["k3-pi"] = HostError(Kind.UNREACHABLE, "k3-pi: no answer")
    done = in_process.swarmctl("trust", str(spec))
    assert done.returncode == exit_codes.HOSTS_UNREACHABLE
    assert done.stderr == "k3-pi  unreachable: no answer\n"
    assert set(pinned(spec)) == {"koala-laptop", "epuck-pi"}


def test_a_lab_has_keys_of_its_own(
    answers: Answers, spec: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(paths.STATE_VARIABLE, str(tmp_path / "state"))
    paths.lab_paths("mine").directory.mkdir(parents=True)
    done = in_process.swarmctl("trust", str(spec), "--lab-name", "mine")
    assert done.returncode == 0, done.stderr
    assert parse(paths.lab_paths("mine").wireguard_keys.read_bytes()) == answers.by_host
    assert not spec.with_name("newswarm.wireguard").exists()
