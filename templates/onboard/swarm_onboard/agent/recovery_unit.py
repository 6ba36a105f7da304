"""The systemd unit that watches over a transaction, and undoes or finishes an open one at the next boot.

It runs before sysinit.target, and so before every ordinary unit: those of the swarm, and the services that
read files of the swarm. Without an open transaction, and without a trial that the boot has interrupted, its
condition is not met, and nothing is started.
"""

from __future__ import annotations

import os
import sys
from contextlib import suppress

from . import files, record, systemd, unit_start
from .errors import FailedError
from .release_store import Home

_FOLDER = "/etc/systemd/system"
_WANTS = _FOLDER + "/sysinit.target.wants"
#: The archive that this code comes from; in tests the folder of its package.
_CODE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
_TEXT = """\
# Written by swarmctl.
[Unit]
Description=Recovery of interrupted deploys of swarm {swarm}
ConditionPathExists=|{mark}
ConditionPathExists=|{trial}
DefaultDependencies=no
RequiresMountsFor={folder}
After=local-fs.target systemd-remount-fs.service
Before=sysinit.target shutdown.target
Conflicts=shutdown.target
StartLimitIntervalSec=0

[Service]
Type=notify
Environment=PYTHONPATH={code} PYTHONDONTWRITEBYTECODE=1
ExecStart={python} -S -s -m swarm_onboard.agent.recovery {swarm}
Restart=on-failure
RestartSec=2
TimeoutStartSec=120
"""


def name(home: Home) -> str:
    """Returns the name of the unit. No unit of a swarm has such a one."""
    return f"swarm-recovery@{home.swarm}.service"


def paths(home: Home) -> tuple[str, str]:
    """Returns the unit's file and the link by which the host starts it when it boots."""
    return f"{_FOLDER}/{name(home)}", f"{_WANTS}/{name(home)}"


def install(home: Home) -> None:
    """Writes the unit and the code that it runs to the disk, where they differ.

    Raises ``FailedError`` and ``OSError``.
    """
    unit, link = paths(home)
    known, text = files.read(home.outside(unit)), unit_text(home).encode("utf-8")
    _put(home.outside(unit), text)
    _keep_code(home)
    if known not in (None, text):  # of another version, whose text systemd may have read
        systemd.call(["systemctl", "daemon-reload"], 90)
    place = home.outside(link)
    if files.pointed(place) != unit:
        os.makedirs(os.path.dirname(place), 0o755, exist_ok=True)
        files.point(place, unit)


def watch(home: Home) -> None:
    """Starts the unit, in place of one that runs; its process waits for the lock of the swarm.

    Raises ``FailedError`` and ``OSError``.
    """
    record.mark(home)
    try:
        systemd.call(["systemctl", "restart", "--", name(home)], 20)
    except FailedError as error:
        log = unit_start.last_log(name(home))
        raise FailedError(f"nothing was changed, since the host could not undo it: {log or error}") from error


def remove(home: Home) -> None:
    """Removes the files of the unit, not synced, and the folder of the link if nothing else is in it.

    A process of the unit ends by itself: it finds no open record.
    """
    unit, link = (home.outside(path) for path in paths(home))
    files.remove(link)
    with suppress(OSError):
        os.rmdir(os.path.dirname(link))
    files.remove(unit)


def unit_text(home: Home) -> str:
    """Returns what the unit's file has, as this version writes it."""
    code = home.recovery_code if os.path.isfile(_CODE) else _CODE
    return _TEXT.format(
        swarm=home.swarm,
        mark=home.open_mark,
        trial=home.trial_file,
        folder=home.path,
        code=code,
        python=sys.executable,
    )


def _keep_code(home: Home) -> None:
    if os.path.isfile(_CODE):
        _put(home.recovery_code, files.read(_CODE) or b"")


def _put(place: str, content: bytes) -> None:
    if files.read(place) != content:
        os.makedirs(os.path.dirname(place), 0o755, exist_ok=True)
        files.replace(place, content)
