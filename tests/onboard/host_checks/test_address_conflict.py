from __future__ import annotations

import socket
from pathlib import Path

import pytest
from swarm_onboard.agent.release_store import Home
from swarm_onboard.host_checks import address_conflict
from swarm_onboard.host_checks.address_conflict import Seen, judge, macs_in, observe, probe, sender

OWN, TWIN = bytes.fromhex("02000000000a"), bytes.fromhex("02000000000b")
LINKS = """\
1: lo: <LOOPBACK,UP,LOWER_UP> mtu 65536 qdisc noqueue state UNKNOWN\\    link/loopback 00:00:00:00:00:00 brd 00:00:00:00:00:00
2: wlan0@if4: <BROADCAST,MULTICAST,UP> mtu 1500 qdisc noqueue\\    link/ether 02:00:00:00:00:0a brd ff:ff:ff:ff:ff:ff link-netnsid 0
3: wg0: <POINTOPOINT,NOARP,UP,LOWER_UP> mtu 1420 qdisc noqueue state UNKNOWN\\    link/none
4: usb0: <BROADCAST,NOARP,UP> mtu 1500 qdisc noqueue\\    link/ether 02:00:00:00:00:0c brd ff:ff:ff:ff:ff:ff
"""  # fmt: skip # noqa: E501


def answer(mac: bytes, address: str) -> bytes:
    """The reply of a machine to the probe of ``OWN``, as Linux sends it."""
    header = OWN + mac + bytes.fromhex("0806 0001 0800 0604 0002")
    return header + mac + socket.inet_aton(address) + OWN + bytes(4) + bytes(18)


class Line:
    """A packet socket on a network where these frames come."""

    def __init__(self, frames: list[bytes]) -> None:
        self.frames, self.sent = frames, list[bytes]()

    def __enter__(self) -> Line:
        return self

    def __exit__(self, *_: object) -> None: ...

    def bind(self, place: tuple[str, int]) -> None:
        assert place == ("wlan0", 0x0806)

    def settimeout(self, seconds: float) -> None: ...

    def getsockname(self) -> tuple[str, int, int, int, bytes]:
        return "wlan0", 0x0806, 0, 1, OWN

    def send(self, frame: bytes) -> None:
        self.sent.append(frame)

    def recv(self, size: int) -> bytes:
        if not self.frames:
            raise TimeoutError
        return self.frames.pop(0)[:size]


def host(folder: Path, line: str = "ROS_IP=10.0.0.5") -> Home:
    """A host whose release has this line in the environment of its nodes."""
    home = Home("new", str(folder))
    env = Path(home.current_link, "env/ros.env")
    env.parent.mkdir(parents=True)
    env.write_text(f"{line}\n")
    return home


def on_a_network(monkeypatch: pytest.MonkeyPatch, frames: list[bytes]) -> Line:
    line = Line(frames)
    monkeypatch.setattr(address_conflict.socket, "socket", lambda *_: line)
    monkeypatch.setattr(
        address_conflict.command,
        "output_of",
        lambda argv, _: LINKS if "link" in argv else "2: wlan0    inet 10.0.0.5/24 scope global wlan0\n",
    )
    return line


def test_a_machine_that_answers_for_the_address_is_bad(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    line = on_a_network(monkeypatch, [answer(TWIN, "10.0.0.5"), answer(TWIN, "10.0.0.5")])
    (seen,) = observe(host(tmp_path))
    found = judge(seen, "pi")
    assert (found.state, "(02:00:00:00:00:0b) has its address 10.0.0.5" in found.message) == ("bad", True)
    assert line.sent == [probe(OWN, "10.0.0.5")]


@pytest.mark.parametrize(
    "frames",
    [
        [],
        [probe(OWN, "10.0.0.5")],  # the host's own
        [answer(bytes.fromhex("02000000000c"), "10.0.0.5")],  # its second interface in the same network
        [answer(TWIN, "10.0.0.6")],
        [probe(TWIN, "10.0.0.5")],  # a machine that looks whether the address is free
        [b"\0" * 60],
        [b""],
    ],
)
def test_other_packets_are_no_conflict(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, frames: list[bytes]
) -> None:
    own_interfaces = LINKS.replace("BROADCAST,NOARP", "BROADCAST")
    on_a_network(monkeypatch, frames)
    monkeypatch.setattr(address_conflict, "macs_in", lambda _: macs_in(own_interfaces))
    assert observe(host(tmp_path)) == [Seen("10.0.0.5", [])]


def test_a_probe_has_no_address_of_its_sender() -> None:
    """So no machine takes the asking one for the owner."""
    frame = probe(OWN, "10.0.0.5")
    assert (len(frame), frame[28:32], frame[38:42]) == (42, bytes(4), socket.inet_aton("10.0.0.5"))
    assert sender(frame, "10.0.0.5") == ""


def test_interfaces_without_arp_are_left_out() -> None:
    assert macs_in(LINKS) == {"wlan0": "02:00:00:00:00:0a"}


@pytest.mark.parametrize("line", ["ROS_HOSTNAME=pi", "ROS_IP=fd00::5", "ROS_DOMAIN_ID=7"])
def test_a_name_or_an_address_of_ipv6_is_not_asked_for(tmp_path: Path, line: str) -> None:
    assert observe(host(tmp_path, line)) == []
