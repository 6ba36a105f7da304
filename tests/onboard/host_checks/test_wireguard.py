from __future__ import annotations

import os
import time
from pathlib import Path

import pytest
from swarm_onboard.agent.release_store import Home
from swarm_onboard.host_checks.wireguard import Seen, judge, observe

PEERS = "[Interface]\nListenPort = 51820\n" + "".join(
    f"\n# {name}\n[Peer]\nPublicKey = {name}=\nAllowedIPs = 10.0.0.1/32\n" for name in ("a", "b")
)


def host(folder: Path, monkeypatch: pytest.MonkeyPatch, *, prints: str) -> Home:
    """A host with two peers in its release, whose wg prints ``prints``."""
    wg = folder / "usr/bin/wg"
    wg.parent.mkdir(parents=True)
    wg.write_text(f"#!/bin/sh\n[ \"$*\" = 'show all latest-handshakes' ] && printf '{prints}'\n")
    wg.chmod(0o755)
    monkeypatch.setenv("PATH", f"{wg.parent}:{os.environ['PATH']}")
    home = Home("new", str(folder))
    release = Path(home.path) / "releases/0123456789abcdef"
    (release / "wireguard").mkdir(parents=True)
    (release / "wireguard/peers.conf").write_text(PEERS)
    Path(home.current_link).symlink_to(release)
    return home


def test_each_peer_has_the_age_of_its_handshake(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ago = int(time.time()) - 1000
    prints = f"wg-other\\tx=\\t0\\nwg-new\\ta=\\t{ago}\\nwg-new\\tb=\\t0\\n"
    first, second = observe(host(tmp_path, monkeypatch, prints=prints))
    assert (first.peer, first.age >= 1000) == ("a", True)
    assert second == Seen("b", -1.0)


@pytest.mark.parametrize("prints", ["", "wg-other\\tx=\\t0\\n"])
def test_while_wireguard_is_down_its_unit_is_the_finding(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, prints: str
) -> None:
    assert observe(host(tmp_path, monkeypatch, prints=prints)) == []


@pytest.mark.parametrize(
    ("age", "state", "message"),
    [
        (0.0, "ok", "a handshake with a 0 s ago"),
        (179.0, "ok", "a handshake with a 179 s ago"),
        (181.0, "bad", "no handshake with a for 3 minutes"),
        (-1.0, "bad", "no handshake with a since it started"),
    ],
)
def test_a_key_is_good_for_three_minutes(age: float, state: str, message: str) -> None:
    found = judge(Seen("a", age), "pi")
    assert (found.state, found.message, found.about, found.peer) == (state, message, "a", "a")
