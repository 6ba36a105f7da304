"""`swarmctl trust` in a sealed swarm: public keys of WireGuard are pinned, and none is replaced silently."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path

import pytest
from swarm_onboard.agent.verbs.wireguard_key import Answer
from swarm_onboard.tunnel.keys import Keys

from swarmctl.cli import exit_codes
from swarmctl.cli.verbs import trust
from swarmctl.cli.where import Where
from swarmctl.deploy import rekey
from swarmctl.lab import paths
from swarmctl.remote.transport import HostError, Kind, Target
from tests import ROOT, in_process

HOSTS = ("koala-laptop", "k3-pi", "epuck-pi")


def key(number: int) -> str:
    return base64.b64encode(bytes([number]) * 32).decode()


class Answers:
    """What the hosts give in place of SSH."""

    def __init__(self) -> None:
        self.by_host: dict[str, str | HostError] = {name: key(number) for number, name in enumerate(HOSTS)}

    def exchanged(
        self, requests: Mapping[str, object], targets: Mapping[str, Target], _transport: object
    ) -> Mapping[str, Answer | HostError]:
        assert not [one for one in requests if targets[one].expelled]
        found = {host: self.by_host[host] for host in requests}
        return {host: one if isinstance(one, HostError) else Answer(one, "") for host, one in found.items()}


@pytest.fixture
def answers(monkeypatch: pytest.MonkeyPatch) -> Answers:
    made = Answers()
    targets = {name: Target(name, "192.168.77.1", "robot", 22, (), ()) for name in HOSTS}
    monkeypatch.setattr(rekey, "exchanged", made.exchanged)
    monkeypatch.setattr(Where, "_real_targets", lambda *_: targets)
    monkeypatch.setattr(Where, "_lab_targets", lambda *_: targets)
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


def keys_in(path: Path) -> Keys:
    return Keys(path.read_text("utf-8"))


def pinned(spec: Path) -> Mapping[str, str]:
    return {host: key for host, (key,) in keys_in(spec.with_name("newswarm.wireguard")).live.items()}


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
    assert keys_in(spec.with_name("newswarm.wireguard")).retired == {"k3-pi": (key(1),)}
    answers.by_host["k3-pi"] = key(1)
    stolen = in_process.swarmctl("trust", str(spec), "--host", "k3-pi", "--replace")
    assert stolen.stderr.startswith("k3-pi  refused: its WireGuard key is retired for good")
    assert (stolen.returncode != 0, pinned(spec)["k3-pi"]) == (True, key(7))


def test_an_expelled_host_is_trusted_again_only_by_name(answers: Answers, spec: Path) -> None:
    in_process.swarmctl("trust", str(spec))
    file = spec.with_name("newswarm.wireguard")
    file.write_text(file.read_text("utf-8") + f"k3-pi {key(1)} retired\n", "utf-8")
    answers.by_host["k3-pi"] = key(7)
    assert in_process.swarmctl("trust", str(spec)).returncode == 0
    assert set(pinned(spec)) == {"koala-laptop", "epuck-pi"}
    assert in_process.swarmctl("trust", str(spec), "--host", "k3-pi", "--replace").returncode == 0
    assert pinned(spec)["k3-pi"] == key(7)


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
    found = keys_in(paths.lab_paths("mine").wireguard_keys).live
    assert found == {host: (key,) for host, key in answers.by_host.items()}
    assert not spec.with_name("newswarm.wireguard").exists()
