from __future__ import annotations

import base64
import json
import time
from pathlib import Path

import pytest
from swarm_onboard.agent.release_store import Home
from swarm_onboard.host_checks.wireguard import Seen, judge, observe
from swarm_onboard.tunnel.keys import line

from tests.onboard.host_checks.hosts import program

PEERS = {"port": 51820, "peers": [{"name": name} for name in ("a", "b", "not-pinned")]}
A, NEXT, B, OTHER = (base64.b64encode(bytes([number]) * 32).decode() for number in range(4))


def host(folder: Path, monkeypatch: pytest.MonkeyPatch, *, prints: str) -> Home:
    """A host with two peers in its release, whose wg prints ``prints``."""
    script = f"[ \"$*\" = 'show all latest-handshakes' ] && printf '{prints}'"
    program(folder, monkeypatch, "wg", script)
    home = Home("new", str(folder))
    release = Path(home.path) / "releases/0123456789abcdef"
    (release / "wireguard").mkdir(parents=True)
    (release / "wireguard/peers.json").write_text(json.dumps(PEERS))
    (folder / "etc/swarm/new").mkdir(parents=True)
    (folder / "etc/swarm/new/wireguard.keys").write_text(line("a", A) + line("a", NEXT) + line("b", B))
    Path(home.current_link).symlink_to(release)
    return home


def test_each_peer_has_the_age_of_its_handshake(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ago = int(time.time()) - 1000
    times = ((OTHER, 0), (A, ago - 50), (NEXT, ago), (B, 0))
    prints = "".join(f"wg-new\\t{key}\\t{last}\\n" for key, last in times)
    first, second = observe(host(tmp_path, monkeypatch, prints=prints))
    assert (first.peer, 1000 <= first.age < 1050) == ("a", True), "the next key counts, too"
    assert second == Seen("b", -1.0)


@pytest.mark.parametrize("prints", ["", f"wg-other\\t{OTHER}\\t0\\n"])
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
