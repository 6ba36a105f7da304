"""The bags of a swarm on the host, and the systemd unit that records them."""

from __future__ import annotations

import os
import shutil
import sys
import time
from contextlib import suppress

from . import disk, files, recorder, systemd, unit_start
from .errors import FailedError
from .named_tuple import NamedTuple
from .paths import BAGS

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Literal, Sequence

    from .release_store import Home

SUFFIXES = (".bag", ".mcap", ".active")  # the last while it is written
_STOPS_WITHIN = 60  # s
_CODE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


class Recording(NamedTuple):
    """The last recording: whether it ``runs``, and since when, s since 1970 by the clock of the host.

    ``ended``: why it has, empty while it goes on, and if there never was one; `lost`: its process is gone, as
    after a power cut. ``status`` and ``output``: exit status and last lines of a command that failed.
    ``bags``: the size in bytes of each file in the folder of bags, of this recording and of earlier ones.
    ``free``: bytes there.
    """

    runs: bool
    began: float
    topics: list[str]
    ended: Literal["", "stopped", "time", "disk", "failed", "lost"]
    status: int
    output: str
    bags: dict[str, int]
    free: int


def folder(home: Home) -> str:
    """Returns the folder of the bags."""
    return home.outside(f"{BAGS}/{home.swarm}")


def unit(home: Home) -> str:
    """Returns the name of the unit. No unit of a swarm has such a one."""
    return f"swarm-recording@{home.swarm}.service"


def start(home: Home, account: str, seconds: float, command: Sequence[str], topics: Sequence[str]) -> None:
    """Starts the recorder as ``account``, which owns the bags. Raises ``FailedError`` and ``OSError``."""
    with suppress(FailedError):  # one that failed keeps the name of the unit
        systemd.call(["systemctl", "reset-failed", "--", unit(home)], 20)
    place = folder(home)
    os.makedirs(place, 0o755, exist_ok=True)
    shutil.chown(place, account)
    wanted = {"seconds": seconds, "command": list(command), "topics": list(topics)}
    recorder.note(place, {**wanted, "began": time.time(), "ended": "", "status": 0, "output": ""})
    properties = {
        "User": account,
        "Environment": f"PYTHONPATH={_CODE} {recorder.CODE}={_CODE} PYTHONDONTWRITEBYTECODE=1",
        "KillMode": "mixed",
        "TimeoutStopSec": str(_STOPS_WITHIN),
    }
    systemd.call(
        [
            *("systemd-run", "--quiet", "--collect", f"--unit={unit(home)}"),
            f"--description=Recording of swarm {home.swarm}",
            *(f"--property={name}={value}" for name, value in properties.items()),
            *("--", sys.executable, "-S", "-s", "-m", recorder.__name__, place),
        ],
        20,
    )


def stop(home: Home) -> None:
    """Ends the recorder, which closes its bag. Raises ``FailedError``."""
    if systemd.running([unit(home)]):
        systemd.call(["systemctl", "stop", "--", unit(home)], _STOPS_WITHIN + 20)


def state(home: Home) -> Recording:
    """Returns how the recording is doing, and the bags of the host."""
    runs = bool(systemd.running([unit(home)]))
    found = Recording(runs, 0.0, [], "", 0, "", {}, 0)
    noted = files.read_json(os.path.join(folder(home), recorder.STATE))
    if isinstance(noted, dict):
        found = found._replace(**{name: noted[name] for name in noted if name in Recording._fields})
        if not runs and not found.ended:
            found = found._replace(ended="lost")
    with suppress(OSError):
        found = found._replace(free=disk.free(folder(home)))
        for name in sorted(os.listdir(folder(home))):
            if name.endswith(SUFFIXES):
                found.bags[name] = os.path.getsize(os.path.join(folder(home), name))
    return found


def wait_until_written(home: Home, before: Sequence[str], seconds: float) -> Recording:
    """Returns the state once a bag is there that is not among those ``before``, or the recording has ended.

    Raises ``FailedError`` if neither happens within ``seconds``; the recording is stopped then.
    """
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        found = state(home)
        if not found.runs and found.ended == "lost":
            raise FailedError(f"the recorder did not start: {unit_start.last_log(unit(home))}")
        if not found.runs or set(found.bags) - set(before):
            return found
        time.sleep(0.2)
    stop(home)
    output = state(home).output
    raise FailedError(
        f"no bag was begun within {seconds:.0f} s{': ' if output else ''}{output}",
        "`swarmctl status SPEC` shows what its graph lacks",
    )
