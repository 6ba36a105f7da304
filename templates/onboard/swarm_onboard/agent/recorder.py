"""Runs the recorder of bags until it is stopped, its time is over, or the disk is nearly full.

A program of its own, in a systemd unit: it goes on without the operator's connection. How it is doing is in
a file of the folder of bags: what it records, since when, and why it has ended.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections import deque

from . import files, json_text

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Mapping

STATE = ".recording.json"
CODE = "SWARM_CODE"  # the variable with the place of this package, for a recorder that is a part of it
# Bytes and share of the disk, of which the smaller counts: twice what `status` warns of.
FULL_BELOW = 400 << 20, 0.10
_LOOK = 0.25  # s
_CLOSES_WITHIN = 40.0  # s for a recorder to write what it still has
_LAST = 3  # lines of its output
_COLOUR, _INFO = re.compile("\x1b\\[[0-9;]*m"), "[ INFO]"  # rosconsole


def nearly_full(folder: str) -> bool:
    """Returns True if the disk of ``folder`` has too little space for more bags."""
    space = os.statvfs(folder)
    bytes_, share = FULL_BELOW
    return space.f_bavail * space.f_frsize < min(bytes_, share * space.f_blocks * space.f_frsize)


def run(folder: str) -> None:
    """Records what the state in ``folder`` says, for its ``seconds``, 0 for ever; SIGTERM stops it."""
    stopped = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: stopped.set())
    state: dict[str, Any] = files.read_json(os.path.join(folder, STATE))
    last: deque[str] = deque(maxlen=_LAST)
    process = subprocess.Popen(
        [*state["command"], *state["topics"]],
        cwd=folder,
        env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"},  # this program's
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    reading = threading.Thread(target=_read, args=(process, last), daemon=True)
    reading.start()
    end = time.monotonic() + (state["seconds"] or float("inf"))
    ended = ""
    while process.poll() is None and not ended:
        if stopped.wait(_LOOK):
            ended = "stopped"
        elif time.monotonic() >= end:
            ended = "time"
        elif nearly_full(folder):
            ended = "disk"
    status = _ended(process)
    reading.join(1)
    note(folder, {**state, "ended": ended or "failed", "status": status, "output": "; ".join(last)})


def note(folder: str, state: Mapping[str, Any]) -> None:
    """Writes the state of the recording in ``folder``. Raises ``OSError``."""
    files.replace(os.path.join(folder, STATE), json_text.dumps(state).encode("ascii"))


def _ended(process: subprocess.Popen[bytes]) -> int:
    """Lets a recorder close its bag; returns its exit status."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
    try:
        return process.wait(_CLOSES_WITHIN)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


def _read(process: subprocess.Popen[bytes], last: deque[str]) -> None:
    assert process.stdout is not None
    for raw in process.stdout:
        text = _COLOUR.sub("", raw.decode("utf-8", "replace")).strip()
        if text:
            if not text.startswith(_INFO):
                last.append(text)
            sys.stdout.write(text + "\n")  # for the journal
            sys.stdout.flush()


if __name__ == "__main__":
    run(sys.argv[1])
