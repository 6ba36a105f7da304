"""The power supply of a Raspberry Pi: whether its voltage is too low, and whether the board slows down."""

from __future__ import annotations

import os

from swarm_onboard.agent import files
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.host_checks import Judged

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.release_store import Home

TABLE = (
    ("the voltage of a Raspberry Pi is too low, or was since it booted", "a warning"),
    ("its processor is slowed down, or was since it booted", "a warning"),
)
_THROTTLED = "/sys/devices/platform/soc/soc:firmware/get_throttled"  # kernels of Raspberry Pi OS
_SENSORS = "/sys/class/hwmon"  # other kernels (kernel.org, raspberrypi-hwmon)
# Bits of `vcgencmd get_throttled` (documentation of Raspberry Pi OS); 16 higher: since the boot.
_LOW, _CAPPED, _SLOWED, _WARM = 1, 2, 4, 8
_NOW, _SINCE_BOOT = 0xFFFF, 16


class Seen(NamedTuple):
    """The bits of ``vcgencmd get_throttled``."""

    bits: int


def observe(home: Home) -> list[Seen]:
    """Reads the firmware's bits, or the alarm of the voltage alone; nothing on other computers."""
    bits = files.read(home.outside(_THROTTLED))
    if bits is not None:
        return [Seen(int(bits, 16))]
    folder = home.outside(_SENSORS)
    for name in sorted(os.listdir(folder)) if os.path.isdir(folder) else ():
        if (files.read(f"{folder}/{name}/name") or b"").strip() == b"rpi_volt":
            return [Seen(int(files.read(f"{folder}/{name}/in0_lcrit_alarm") or b"0"))]
    return []


def judge(seen: Seen, host: str) -> Judged:
    """Warns of what makes a board slow, restart, or damage its card."""
    now, before = seen.bits & _NOW, seen.bits >> _SINCE_BOOT
    if (now | before) & _LOW:
        text = "the voltage is too low" if now & _LOW else "the voltage was too low since it booted"
        hint = "a stronger power supply or battery, and a short thick cable; no motors on the same 5 V"
        return Judged("warning", f"{text}: the board slows down, and may restart", hint)
    if (now | before) & (_CAPPED | _SLOWED | _WARM):
        text = "is slowed down" if now else "was slowed down since it booted"
        return Judged("warning", f"the processor {text}", "let more air to it, or have it do less")
    return Judged("ok", "the voltage is right")
