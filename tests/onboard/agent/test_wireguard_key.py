"""The WireGuard key of a host: made once, for root alone, and gone with the swarm."""

from __future__ import annotations

import shutil
import subprocess

import pytest
from swarm_onboard.agent import command, wireguard_key
from swarm_onboard.agent.errors import FailedError, RefusedError
from swarm_onboard.agent.release_store import Home
from swarm_onboard.tunnel.keys import Keys, line

from tests.onboard.agent.fakehost import FakeHost, Reply, bundle, decode

pytestmark = pytest.mark.skipif(shutil.which("wg") is None, reason="needs wg")
# A new key is used once there are four.
WAITS_FOR_OTHERS = """
[ $1 = genkey ] || exec $REAL "$@"
$REAL genkey; echo >> $SWARM_PREFIX/made
while [ $(wc -l < $SWARM_PREFIX/made) -lt 4 ]; do sleep 0.01; done
"""
KEY = "etc/swarm/new/wireguard.key"


ASKS = {"verb": "wireguard_key", "swarm": "new"}


def public(host: FakeHost) -> Reply:
    return host.ask(ASKS)


def test_a_host_makes_its_key_once(host: FakeHost) -> None:
    key = public(host).answer["public"]
    private = (host.prefix / KEY).read_text()
    assert subprocess.check_output(["wg", "pubkey"], input=private, text=True).strip() == key
    assert (host.prefix / KEY).stat().st_mode & 0o777 == 0o600
    assert public(host).answer["public"] == key
    assert (host.prefix / KEY).read_text() == private


@pytest.mark.parametrize("damage", ["", "x" * 44])
def test_a_damaged_key_is_not_replaced(host: FakeHost, damage: str) -> None:
    public(host)
    (host.prefix / KEY).write_text(damage)
    error = public(host).error
    assert error["message"].startswith(f"{host.prefix / KEY} has no key of WireGuard: ")
    assert error["hint"].startswith("restore that file; or remove it, and `swarmctl trust` with --replace")
    assert (host.prefix / KEY).read_text() == damage


def test_agents_at_once_give_one_key(host: FakeHost) -> None:
    wg = host.prefix / "bin/wg"
    wg.write_text(f"#!/bin/sh\nREAL={shutil.which('wg')}\n{WAITS_FOR_OTHERS}")
    wg.chmod(0o755)
    agents = [host.begin({"verb": "wireguard_key", "swarm": "new"}) for _ in range(4)]
    found = set()
    for agent in agents:
        with agent:
            assert agent.stdout is not None
            found.add(decode(agent.stdout.read().strip())["answer"]["public"])
    assert found == {public(host).answer["public"]}


@pytest.mark.parametrize("deployed", [True, False])
def test_a_removed_swarm_leaves_no_key(host: FakeHost, deployed: bool) -> None:
    if deployed:
        host.apply(bundle("1"))
    public(host)
    assert host.ask({"verb": "wireguard_key", "swarm": "other"}).answer
    assert host.ask({"verb": "remove", "swarm": "new"}).answer == {"removed": deployed}
    assert [one.name for one in (host.prefix / "etc/swarm").iterdir()] == ["other"]
    host.ask({"verb": "remove", "swarm": "other"})
    assert not (host.prefix / "etc/swarm").exists()


def test_a_host_changes_to_its_next_key_once(host: FakeHost) -> None:
    old = public(host).answer["public"]
    following = host.ask({**ASKS, "make_next": True}).answer["next"]
    assert host.ask({**ASKS, "make_next": True}).answer == {"public": old, "next": following}
    refused = host.ask({**ASKS, "use": old[::-1]})
    assert refused.error["message"] == "it has another next WireGuard key"
    for _ in range(2):
        assert host.ask({**ASKS, "use": following}).answer == {"public": following, "next": ""}
    assert (host.prefix / KEY).stat().st_mode & 0o777 == 0o600


def test_a_key_that_wireguard_does_not_take_is_put_back(
    host: FakeHost, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = Home("new", str(host.prefix))
    old, following = public(host).answer["public"], host.ask({**ASKS, "make_next": True}).answer["next"]
    private = (host.prefix / KEY).read_text()
    monkeypatch.setattr(command, "output_of", lambda argv: f"wg-new\t{old}\n" if "public-key" in argv else "")
    monkeypatch.setattr(wireguard_key, "_PATIENCE", 0.0)
    with pytest.raises(FailedError, match="did not take the new key within 0 s, and has the old one again"):
        wireguard_key.change_to(home, following)
    assert (host.prefix / KEY).read_text() == private
    assert host.ask(ASKS).answer == {"public": old, "next": following}


def test_the_next_key_is_never_the_present_one(host: FakeHost) -> None:
    key = public(host).answer["public"]
    (host.prefix / f"{KEY}.next").write_text((host.prefix / KEY).read_text())
    assert host.ask({**ASKS, "use": key}).answer == {"public": key, "next": ""}


def test_a_host_retires_every_key_of_a_lost_one(host: FakeHost) -> None:
    keys = [f"{letter}{'A' * 42}=" for letter in "ABC"]
    known = line("pi", keys[0]) + line("pi", keys[1]) + line("k3-pi", keys[2])
    host.ask({**ASKS, "known": known})
    host.ask({**ASKS, "known": "# no key\n", "expel": "pi"})
    found = Keys((host.prefix / "etc/swarm/new/wireguard.keys").read_text())
    assert (found.live, found.retired) == ({"k3-pi": (keys[2],)}, {"pi": (keys[0], keys[1])})


def test_an_interface_that_keeps_a_lost_key_is_named(host: FakeHost, monkeypatch: pytest.MonkeyPatch) -> None:
    key = f"B{'A' * 42}="
    host.ask({**ASKS, "known": line("pi", key)})
    monkeypatch.setattr(command, "output_of", lambda argv: f"wg-new\t{key}\n" if "peers" in argv else "")
    monkeypatch.setattr(wireguard_key, "_PATIENCE", 0.0)
    with pytest.raises(FailedError, match="its WireGuard still has the key of pi"):
        wireguard_key.expel(Home("new", str(host.prefix)), "pi")


def test_agents_at_once_lose_no_key(host: FakeHost) -> None:
    keys = [f"{letter}{'A' * 42}=" for letter in "ABCD"]
    agents = [host.begin({**ASKS, "known": line(f"pi-{n}", key)}) for n, key in enumerate(keys)]
    for agent in agents:
        with agent:
            assert agent.stdout is not None
            assert "answer" in decode(agent.stdout.read().strip())
    found = Keys((host.prefix / "etc/swarm/new/wireguard.keys").read_text())
    assert found.live == {f"pi-{n}": (key,) for n, key in enumerate(keys)}


def test_a_deploy_brings_keys_and_a_rollback_takes_none_back(host: FakeHost) -> None:
    key = f"B{'A' * 42}="
    host.apply(bundle("1"), wireguard_keys=line("pi", key))
    host.apply(bundle("2"), wireguard_keys=line("pi", key, retired=True), previous=bundle("1").digest)
    back = {"verb": "rollback", "swarm": "new", "txid": "b" * 16, "previous": bundle("2").digest}
    host.ask({**back, "next": bundle("1").digest, "secrets": ""})
    assert (host.prefix / "opt/swarm/new/current").readlink().name == bundle("1").digest
    seen = host.ask({"verb": "observe", "swarm": "new", "wireguard_keys": line("pi", key)})
    assert not seen.answer["wireguard_keys"], "it knows the key, and that it is retired"
    seen = host.ask({"verb": "observe", "swarm": "new", "wireguard_keys": line("k3-pi", key[::-1])})
    assert not seen.answer["wireguard_keys"], "that is no key"


def test_a_killed_agent_leaves_no_half_key(host: FakeHost) -> None:
    assert host.ask({"verb": "wireguard_key", "swarm": "new"}, failpoint="after:key").status == 137
    assert not (host.prefix / KEY).exists()
    assert public(host).answer
    host.ask({"verb": "remove", "swarm": "new"})
    assert not (host.prefix / "etc/swarm").exists()


def test_a_host_without_wg_is_named(host: FakeHost, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "plain_environment", lambda: {"PATH": "/nowhere"})
    with pytest.raises(RefusedError, match="no `wg`") as refusal:
        wireguard_key.public(Home("new", str(host.prefix)))
    assert "wireguard-tools" in refusal.value.hint
    assert not (host.prefix / "etc/swarm").exists()
