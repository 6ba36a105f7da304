"""`swarmctl rekey` and `swarmctl expel`: what they print, and which end with which code."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path

import pytest
from swarm_onboard.agent.verbs.wireguard_key import Answer, Request
from swarm_onboard.tunnel.keys import Keys, line

from swarmctl.cli import exit_codes
from swarmctl.cli.where import Where
from swarmctl.deploy import rekey
from swarmctl.remote.transport import HostError, Kind, Target
from tests import ROOT, in_process

HOSTS = ("koala-laptop", "k3-pi", "epuck-pi")


def key(number: int) -> str:
    return base64.b64encode(bytes([number]) * 32).decode()


class Hosts:
    """Hosts that change their key as requested; some are away."""

    def __init__(self) -> None:
        self.key = {name: key(number) for number, name in enumerate(HOSTS)}
        self.away: set[str] = set()
        self.reached: set[str] = set()

    def exchanged(
        self, requests: Mapping[str, Request], targets: Mapping[str, Target], _way: object
    ) -> Mapping[str, Answer | HostError]:
        self.reached |= requests.keys()
        return {host: self._answer(host, request) for host, request in requests.items()}

    def _answer(self, host: str, request: Request) -> Answer | HostError:
        if host in self.away:
            return HostError(Kind.UNREACHABLE, f"{host}: no answer")
        self.key[host] = request.use or self.key[host]
        return Answer(self.key[host], key(HOSTS.index(host) + 10))


@pytest.fixture
def hosts(monkeypatch: pytest.MonkeyPatch) -> Hosts:
    made = Hosts()
    targets = {name: Target(name, "192.168.77.1", "robot") for name in HOSTS}
    monkeypatch.setattr(rekey, "exchanged", made.exchanged)
    monkeypatch.setattr(Where, "_real_targets", lambda *_: targets)
    return made


@pytest.fixture
def spec(tmp_path: Path, hosts: Hosts) -> Path:
    path = tmp_path / "lab.yaml"
    text = (ROOT / "examples/paper-leader/swarm.yaml").read_text("utf-8")
    path.write_text(f"{text}security: sealed\n", "utf-8")
    path.with_name("newswarm.wireguard").write_text("".join(line(*one) for one in hosts.key.items()))
    return path


def pinned(spec: Path) -> Keys:
    return Keys(spec.with_name("newswarm.wireguard").read_text())


def test_new_keys_are_pinned_beside_the_spec(hosts: Hosts, spec: Path) -> None:
    done = in_process.swarmctl("rekey", str(spec), "--limit", "k3-pi")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith(f"k3-pi: a new WireGuard key, pinned in {spec.parent}/newswarm.wireguard\n")
    assert pinned(spec).live == {"koala-laptop": (key(0),), "k3-pi": (key(11),), "epuck-pi": (key(2),)}
    assert pinned(spec).retired == {"k3-pi": (key(1),)}


def test_a_host_whose_peer_is_away_keeps_its_key(hosts: Hosts, spec: Path) -> None:
    hosts.away = {"epuck-pi"}
    done = in_process.swarmctl("rekey", str(spec), "--limit", "koala-laptop")
    assert done.returncode == exit_codes.HOSTS_FAILED
    assert "koala-laptop  held back: epuck-pi does not know its next key; it keeps its key\n" in done.stderr
    assert "epuck-pi  unreachable: epuck-pi: no answer" in done.stderr
    assert (hosts.key["koala-laptop"], pinned(spec).retired) == (key(0), {})


def test_a_lost_host_is_not_contacted(hosts: Hosts, spec: Path) -> None:
    done = in_process.swarmctl("expel", str(spec), "k3-pi", "--yes")
    assert (done.returncode, done.stderr) == (0, "")
    assert "; not accepted any more by koala-laptop, epuck-pi\n" in done.stdout
    assert pinned(spec).expelled == {"k3-pi"}
    in_process.swarmctl("rekey", str(spec))
    assert hosts.reached == {"koala-laptop", "epuck-pi"}


def test_hosts_that_are_away_are_named(hosts: Hosts, spec: Path) -> None:
    hosts.away = {"epuck-pi"}
    done = in_process.swarmctl("expel", str(spec), "k3-pi", "--yes")
    assert done.returncode == exit_codes.HOSTS_UNREACHABLE
    assert "it accepts k3-pi until the next deploy, or the same command, reaches it" in done.stderr
    assert pinned(spec).expelled == {"k3-pi"}, "whoever answers"


@pytest.mark.parametrize("verb", [("rekey",), ("expel", "k3-pi", "--yes")], ids=["rekey", "expel"])
def test_a_swarm_that_is_not_sealed_has_no_keys(verb: tuple[str, ...], hosts: Hosts, spec: Path) -> None:
    spec.write_text((ROOT / "examples/paper-leader/swarm.yaml").read_text("utf-8"))
    done = in_process.swarmctl(verb[0], str(spec), *verb[1:])
    assert done.returncode == exit_codes.ERROR
    assert "has no WireGuard keys\n  help: they belong to `security: sealed`" in done.stderr
    assert hosts.reached == set()


def test_a_host_without_a_key_is_not_expelled(hosts: Hosts, spec: Path) -> None:
    spec.with_name("newswarm.wireguard").unlink()
    done = in_process.swarmctl("expel", str(spec), "k3-pi", "--yes")
    assert done.returncode == exit_codes.ERROR
    assert "k3-pi has no pinned WireGuard key: no host accepts it" in done.stderr
