"""The radio of a host: how strong its signal is, and whether the radio sleeps between packets."""

from __future__ import annotations

import fcntl
import socket
import struct

from swarm_onboard.agent import files
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.host_checks import Judged

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.release_store import Home

TABLE = (
    ("the signal of its Wi-Fi is weaker than -75 dBm", "a warning"),
    ("its Wi-Fi saves power: packets for it wait until the radio wakes up", "a warning"),
)
_WEAK = -75  # dBm, a rule of thumb: below, rates fall and packets are repeated
_RADIOS = "/proc/net/wireless"
_GET_POWER = 0x8B2D  # SIOCGIWPOWER of linux/wireless.h
_REQUEST = struct.Struct("16siBBH4x4x")  # struct iwreq with an iw_param: name, value, fixed, disabled, flags


class Seen(NamedTuple):
    """A radio that is connected. ``signal`` in dBm; ``saves_power`` is None where that is not known."""

    name: str
    signal: float
    saves_power: bool | None


def observe(home: Home) -> list[Seen]:
    """Reads the wireless extensions of the kernel (/proc/net/wireless); nothing without a radio."""
    lines = (files.read(home.outside(_RADIOS)) or b"").decode("ascii", "replace").splitlines()
    found = []
    for line in lines[2:]:
        name, _, rest = line.partition(":")
        words = rest.split()
        if len(words) > 2 and float(words[2]) < 0:  # other drivers count in units of their own
            found.append(Seen(name.strip(), float(words[2]), _saves_power(name.strip())))
    return found


def _saves_power(name: str) -> bool | None:
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
            reply = fcntl.ioctl(any_socket, _GET_POWER, _REQUEST.pack(name.encode(), 0, 0, 0, 0))
    except OSError:
        return None
    return not _REQUEST.unpack(reply)[3]


def judge(seen: Seen, host: str) -> Judged:
    """Warns of a radio that loses or delays packets."""
    text = f"its signal has {seen.signal:.0f} dBm"
    if seen.signal < _WEAK:
        hint = "bring the access point nearer, or use another channel or antenna"
        return Judged("warning", f"{text}: packets are repeated and lost", hint, seen.name)
    if seen.saves_power:
        hint = f"on {host}, until it restarts: sudo iw dev {seen.name} set power_save off"
        return Judged("warning", "it saves power: packets for it wait until it wakes up", hint, seen.name)
    return Judged("ok", text, "", seen.name)
