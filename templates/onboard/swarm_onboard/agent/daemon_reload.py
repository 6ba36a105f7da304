"""The system's daemons that read files of a release: how each reads them again."""

from __future__ import annotations

import os

from . import systemd, unit_start
from .errors import FailedError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Sequence

    from .release_store import Home

# chronyd reads its file only when it starts.
_SERVICES = {
    "chrony": ("chrony.service", "restart"),
    "NetworkManager": ("NetworkManager.service", "reload-or-restart"),
}


def reload(home: Home, names: Sequence[str]) -> None:
    """Makes daemons read their files again; udev applies its rules to the devices present.

    Raises ``FailedError`` with the last log lines of one that refuses its file.
    """
    if "systemd" in names:
        systemd.call(["systemctl", "daemon-reload"], 90)
    if "udev" in names and os.path.exists(home.outside("/run/udev/control")):
        systemd.call(["udevadm", "control", "--reload"], 20)
        kinds = ("--subsystem-match=tty", "--subsystem-match=usb-serial")
        systemd.call(["udevadm", "trigger", "--action=change", *kinds], 20)
        systemd.call(["udevadm", "settle", "--timeout=10"], 20)
    for name, (unit, verb) in _SERVICES.items():
        # One that is stopped reads its file when it starts; one that failed may have died of what is undone.
        if name in names and systemd.states([unit])[unit].active != "inactive":
            systemd.call(["systemctl", "reset-failed", "--", unit], 20)
            _again(unit, verb)


def _again(unit: str, verb: str) -> None:
    try:
        systemd.call(["systemctl", verb, "--", unit], 90)
    except FailedError as error:
        log = unit_start.last_log(unit)
        raise FailedError(f"{unit} does not take its new file: {log}" if log else str(error)) from error
