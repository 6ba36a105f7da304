"""How many packets to other hosts and back are lost, as ping(8) counts them beside other work."""

from __future__ import annotations

import re
import subprocess
from contextlib import suppress

from .command import plain_environment
from .observations import PingSeen

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Mapping

_INTERVAL = 0.05  # s
_LAST_REPLY = 1  # s that ping waits for it
_PATIENCE = 1.0  # s
_COUNTS = re.compile(r"(\d+) packets transmitted, (\d+) (?:packets )?received")  # also that of busybox


class Pings:
    """Pings some addresses, each for some seconds. A host without ping has no counts."""

    def __init__(self, addresses: Mapping[str, float]) -> None:
        self._addresses = addresses
        self._running: dict[str, subprocess.Popen[bytes]] = {}
        with suppress(OSError):  # the host has no ping
            for address, seconds in addresses.items():
                self._running[address] = _start(address, float(seconds))

    def counts(self) -> dict[str, PingSeen]:
        """Returns how many packets were sent to each address and answered, once that is done."""
        found: dict[str, PingSeen] = {}
        for address, process in self._running.items():
            try:
                output = process.communicate(timeout=self._addresses[address] + _LAST_REPLY + _PATIENCE)[0]
            except subprocess.TimeoutExpired:
                process.kill()
                process.communicate()
                continue
            counts = _COUNTS.search(output.decode("utf-8", "replace"))
            if counts:
                found[address] = PingSeen(int(counts[1]), int(counts[2]))
        return found


def _start(address: str, seconds: float) -> subprocess.Popen[bytes]:
    count = max(1, round(seconds / _INTERVAL))
    argv = ["ping", "-q", "-n", "-c", str(count), "-i", str(_INTERVAL), "-W", str(_LAST_REPLY), "--", address]
    return subprocess.Popen(
        argv,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=plain_environment(),
    )
