from __future__ import annotations

import fcntl
import struct
from pathlib import Path

import pytest
from swarm_onboard.agent.release_store import Home
from swarm_onboard.host_checks.wifi import Seen, judge, observe

HEAD = """\
Inter-| sta-|   Quality        |   Discarded packets               | Missed | WE
 face | tus | link  level noise |  nwid  crypt   frag  retry   misc | beacon | 22
"""
NAMES = {"wlan0": False, "wlan1": True}  # whether it saves power


def ioctl(_: object, number: int, request: bytes) -> bytes:
    """The kernel's answer to SIOCGIWPOWER: `disabled`, the byte behind `fixed`."""
    assert number == 0x8B2D
    name = request[:16].rstrip(b"\0").decode()
    if name not in NAMES:
        raise OSError(22, "Invalid argument")
    return struct.pack("16siBBH8x", name.encode(), 0, 0, int(not NAMES[name]), 0)


@pytest.mark.parametrize("radios", [["wlan0", "wlan1", "wlx1"], []])
def test_each_radio_that_is_connected_is_observed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, radios: list[str]
) -> None:
    monkeypatch.setattr(fcntl, "ioctl", ioctl)
    (tmp_path / "proc/net").mkdir(parents=True)
    lines = [
        f" {one}: 0000   54.  -56.  -256        0      0      0      0   1234        0\n" for one in radios
    ]
    (tmp_path / "proc/net/wireless").write_text(HEAD + "".join(lines))
    found = [(one.name, one.signal, one.saves_power) for one in observe(Home("new", str(tmp_path)))]
    assert found == [("wlan0", -56.0, False), ("wlan1", -56.0, True), ("wlx1", -56.0, None)][: len(radios)]


def test_a_host_without_a_radio_is_not_checked(tmp_path: Path) -> None:
    assert observe(Home("new", str(tmp_path))) == []


@pytest.mark.parametrize(
    ("seen", "state", "message"),
    [
        (Seen("wlan0", -56.0, saves_power=False), "ok", "-56 dBm"),
        (Seen("wlan0", -82.0, saves_power=True), "warning", "-82 dBm"),
        (Seen("wlan0", -56.0, saves_power=True), "warning", "it saves power"),
        (Seen("wlan0", -56.0, saves_power=None), "ok", "-56 dBm"),
    ],
)
def test_a_radio_that_loses_or_delays_packets_is_a_warning(seen: Seen, state: str, message: str) -> None:
    found = judge(seen, "pi")
    assert (found.state, found.about, message in found.message) == (state, "wlan0", True)
