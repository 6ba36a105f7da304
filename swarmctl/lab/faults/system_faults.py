"""Faults of a host's system: its clock, and the file system of /opt/swarm."""

from __future__ import annotations

import re
from typing import Any

from swarmctl.lab.faults.fault_kind import FaultOption, scripted

PLACE = "/opt/swarm"
# Every Python loads it when it starts, also with -I and -S, as the agent of swarmctl does.
_LOADED = "/usr/lib/python3.*/encodings/__init__.py"
_MARK = "# a fault of the lab"


def step(text: str) -> float:
    """Reads by how many seconds a clock is ahead; negative: behind."""
    if not re.fullmatch(r"[-+]?\d+(\.\d+)?", text) or not float(text):
        raise ValueError("write seconds, such as 5 or -0.5")
    return float(text)


END_OF_CLOCK = f"sed -i '/{_MARK}$/d' {_LOADED}"
END_OF_MOUNT = f"while mountpoint -q {PLACE}; do umount --lazy {PLACE}; done"


def clock_script(seconds: float) -> str:
    """Returns the script after which new Python processes of a host see its clock ``seconds`` ahead."""
    ahead = "time.{0} = (lambda now: lambda: now() + {1})(time.{0})"
    code = f"import time; {ahead.format('time', seconds)}; {ahead.format('time_ns', int(seconds * 1e9))}"
    return f"{END_OF_CLOCK}\nsed -i '$ a {code}  {_MARK}' {_LOADED}"


def full_script() -> str:
    """Returns the script that moves a copy of ``PLACE`` in front of it, on a file system without space."""
    return f"""\
set -e
{END_OF_MOUNT}
mkdir -p {PLACE} /run/lab-full
size=$(($(du -sk {PLACE} | cut -f1) + 1024))
mount -t tmpfs -o mode=755,size=${{size}}k lab-full /run/lab-full
cp -a {PLACE}/. /run/lab-full
mount --bind /run/lab-full {PLACE}
umount /run/lab-full
dd if=/dev/zero of={PLACE}/lab-full bs=64k 2>/dev/null || true"""


def read_only_script() -> str:
    """Returns the script that makes ``PLACE`` read-only."""
    return f"""\
set -e
{END_OF_MOUNT}
mkdir -p {PLACE}
mount --bind {PLACE} {PLACE}
mount -o remount,bind,ro {PLACE}"""


def _clock_outcome(seconds: Any) -> str:
    return f"new Python processes see its clock {abs(seconds):g} s {'ahead' if seconds > 0 else 'behind'}"


CLOCK = scripted(
    "clock",
    "Step the clock of hosts for Python processes that start from now on; hosts share the machine's own.",
    clock_script,
    END_OF_CLOCK,
    outcome=_clock_outcome,
    option=FaultOption("step", "SECONDS", "How far the clock is ahead; behind, if negative.", step),
)
DISK_FULL = scripted(
    "disk-full",
    f"Fill the file system of {PLACE} on hosts. What is written there meanwhile is lost in the end.",
    lambda _: full_script(),
    END_OF_MOUNT,
    outcome=lambda _: f"{PLACE} is full",
)
READ_ONLY = scripted(
    "read-only",
    f"Make {PLACE} read-only on hosts.",
    lambda _: read_only_script(),
    END_OF_MOUNT,
    outcome=lambda _: f"{PLACE} is read-only",
)
