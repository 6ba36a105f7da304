"""A node of Fast DDS announces itself to its peers once it listens, and not before."""

from __future__ import annotations

import re
import select
import socket
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from swarm_onboard.agent.process_environment import variables_in
from swarm_onboard.ros2_probe import announcements

from tests.render.test_bundles import GOLDEN

HOST, PACKET = "k3-pi", b"RTPS and what follows"


def released(case: str, place: Path) -> dict[str, str]:
    """The environment of a rendered release, whose hosts have addresses of this machine."""
    release = GOLDEN / "ros2" / case / HOST / "env"
    for file in release.iterdir():
        (place / file.name).write_text(re.sub(r"\b(10|192)\.\d+\.\d+\.", "127.9.9.", file.read_text()))
    found = variables_in((place / "ros.env").read_text())
    return {name: re.sub(r"^/opt/.*/", f"{place}/", value) for name, value in found.items()}


def announced_to(profile: Path) -> tuple[str, int]:
    """The only peer of a profile."""
    (peers,) = re.findall("<initialPeersList>(.*)</initialPeersList>", profile.read_text())
    ((address, port),) = re.findall(r"<address>([\d.]+)</address><port>(\d+)</port>", peers)
    return address, int(port)


@pytest.fixture
def sent() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        yield found


OTHERS = ["127.9.9.10", "127.9.9.11"]


@pytest.mark.parametrize(
    ("case", "here"), [("jazzy-peers", "127.9.9.12"), ("humble-peers", "127.9.9.12"), ("peers", "127.0.0.1")]
)
def test_packets_go_to_all_peers_after_the_node_is_made(
    case: str, here: str, tmp_path: Path, sent: socket.socket
) -> None:
    variables = released(case, tmp_path)
    before = dict(variables)
    send_on = announcements.held(variables)
    (name,) = (one for one in variables if one.endswith("_PROFILES_FILE"))
    profile = Path(variables[name])
    kept = r"<interfaceWhiteList>.*</interfaceWhiteList>"
    assert re.findall(kept, profile.read_text(), re.S) == re.findall(
        kept, Path(before[name]).read_text(), re.S
    )
    assert "ROS_STATIC_PEERS" not in variables
    domain = int(before["ROS_DOMAIN_ID"])
    hosts = [here, *OTHERS]
    with ExitStack() as stack:
        peers = [stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in hosts]
        for peer, host in zip(peers, hosts, strict=True):
            peer.bind((host, 7400 + 250 * domain + 10 + 2 * 3))
            peer.settimeout(60)
        sent.sendto(PACKET, announced_to(profile))
        assert select.select(peers, [], [], 0)[0] == []
        send_on()
        assert {peer.recv(100) for peer in peers} == {PACKET}
    assert not profile.exists()


@pytest.mark.parametrize("case", ["central", "multicast", "cyclonedds", "zenoh"])
def test_nodes_without_a_list_of_peers_announce_themselves(case: str, tmp_path: Path) -> None:
    variables = released(case, tmp_path)
    before = dict(variables)
    announcements.held(variables)()
    assert variables == before


@pytest.mark.parametrize("content", ["", "<dds/>", "<dds><initialPeersList>", None])
def test_a_profile_that_somebody_edited_is_left_to_fast_dds(content: str | None, tmp_path: Path) -> None:
    variables = released("jazzy-peers", tmp_path)
    file = tmp_path / "fastdds.xml"
    file.unlink()
    if content is not None:
        file.write_text(content)
    before = dict(variables)
    announcements.held(variables)()
    assert variables == before


def test_a_host_without_a_place_for_files_is_looked_at(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    variables = released("jazzy-peers", tmp_path)
    before = dict(variables)
    monkeypatch.setattr(tempfile, "tempdir", "/proc/none")
    announcements.held(variables)()
    assert variables == before
