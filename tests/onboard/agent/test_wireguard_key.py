"""The WireGuard key of a host: made once, for root alone, and gone with the swarm."""

from __future__ import annotations

import shutil
import subprocess

import pytest
from swarm_onboard.agent import command, wireguard_key
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.release_store import Home

from tests.onboard.agent.fakehost import FakeHost, Reply, bundle, decode

pytestmark = pytest.mark.skipif(shutil.which("wg") is None, reason="needs wg")
# A new key is used once there are four.
WAITS_FOR_OTHERS = """
[ $1 = genkey ] || exec $REAL "$@"
$REAL genkey; echo >> $SWARM_PREFIX/made
while [ $(wc -l < $SWARM_PREFIX/made) -lt 4 ]; do sleep 0.01; done
"""
KEY = "etc/swarm/new/wireguard.key"


def public(host: FakeHost) -> Reply:
    return host.ask({"verb": "wireguard_key", "swarm": "new"})


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
