"""The temperature of a board's processor."""

from __future__ import annotations

import os
from contextlib import suppress

from swarm_onboard.agent import files
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.host_checks import Judged

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.release_store import Home

TABLE = (("the processor of a small board has 80 °C or more", "a warning"),)
_ZONES = "/sys/class/thermal"
_BOARD = ("cpu", "soc")  # how the types of zones begin on boards such as a Raspberry Pi; PCs bear more
_HOT = 80.0  # degrees Celsius: from here on a Raspberry Pi slows down (its documentation, "Frequency
# management and thermal control")


class Seen(NamedTuple):
    """The warmest part of the processor, in degrees Celsius."""

    celsius: float


def observe(home: Home) -> list[Seen]:
    """Reads the thermal zones of the kernel (sysfs-class-thermal); nothing on computers other than boards."""
    folder = home.outside(_ZONES)
    found = []
    for name in sorted(os.listdir(folder)) if os.path.isdir(folder) else ():
        kind = files.read(f"{folder}/{name}/type") or b""
        if kind.decode("ascii", "replace").lower().startswith(_BOARD):
            with suppress(OSError, ValueError):  # a sensor that is off has no value
                found.append(int(files.read(f"{folder}/{name}/temp") or b"") / 1000)
    return [Seen(max(found))] if found else []


def judge(seen: Seen, host: str) -> Judged:
    """Warns of a processor that slows down."""
    text = f"the processor has {seen.celsius:.0f} °C"
    if seen.celsius < _HOT:
        return Judged("ok", text)
    return Judged("warning", f"{text}: it may run more slowly", "let more air to it, or have it do less")
