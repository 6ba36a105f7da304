"""systemd, udev and other services, by their commands, each with a timeout."""

from __future__ import annotations

import json
import os
import subprocess
from typing import TYPE_CHECKING, Any, Sequence, cast

from .errors import FailedError
from .release_store import Home

if TYPE_CHECKING:
    from .messages import UnitState

_FIELDS = {
    "ActiveState": "active",
    "SubState": "sub",
    "LoadState": "load",
    "Result": "result",
    "StatusText": "text",
}
_NUMBERS = {"MainPID": "pid", "NRestarts": "restarts"}
_CONDITION = ("ConditionResult", "ConditionTimestampMonotonic")


# How a service reads its file again. chronyd only does when it starts.
_SERVICES = {
    "chrony": ("chrony.service", "restart"),
    "NetworkManager": ("NetworkManager.service", "reload-or-restart"),
}
_WORDS, _LONGEST_WORDS = 5, 600  # lines, characters


def present(home: Home) -> bool:
    """Returns True if the host runs systemd."""
    return os.path.isdir(home.outside("/run/systemd/system"))


def _call(command: Sequence[str], timeout: float) -> str:
    environment = dict(os.environ, LC_ALL="C", SYSTEMD_COLORS="0")
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=timeout,
            env=environment,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise FailedError("`{}` did not end within {:g} s".format(" ".join(command), timeout)) from None
    except OSError as error:
        raise FailedError(f"`{command[0]}` cannot be run: {error}") from error
    if done.returncode != 0:
        complaint = done.stderr.decode("utf-8", "replace").strip() or f"status {done.returncode}"
        raise FailedError("`{}` failed: {}".format(" ".join(command), " ".join(complaint.split())))
    return done.stdout.decode("utf-8", "replace")


def states(units: Sequence[str]) -> dict[str, UnitState]:
    """Returns the state of each unit: load, active and sub state, main process, restarts, the last result.

    ``skipped``: it does not run because a condition of the unit was checked and not met.
    """
    if not units:
        return {}
    fields = ",".join(["Id", *_FIELDS, *_NUMBERS, *_CONDITION])
    output = _call(["systemctl", "show", "--no-pager", "-p", fields, "--", *units], 20)
    found: dict[str, UnitState] = {}
    for unit, paragraph in zip(units, output.strip("\n").split("\n\n")):
        values = dict(line.split("=", 1) for line in paragraph.splitlines() if "=" in line)
        state: dict[str, Any] = {short: values.get(name, "") for name, short in _FIELDS.items()}
        state.update({short: int(values.get(name) or 0) for name, short in _NUMBERS.items()})
        met, looked = (values.get(name, "") for name in _CONDITION)
        unmet = met == "no" and looked not in ("", "0")
        state["skipped"] = state["active"] == "inactive" and (unmet or state["result"] == "exec-condition")
        found[unit] = cast("UnitState", state)
    return found


def running(units: Sequence[str]) -> list[str]:
    """Returns those of ``units`` that run or start."""
    known = states(units)
    return [unit for unit in units if known[unit]["active"] not in ("inactive", "failed")]


def stop(units: Sequence[str]) -> None:
    """Stops units together; a unit unknown to systemd counts as stopped."""
    known = states(units)
    loaded = [u for u in units if known[u]["load"] != "not-found" or known[u]["active"] != "inactive"]
    if loaded:
        _call(["systemctl", "stop", "--", *loaded], 90)


def start(units: Sequence[str]) -> None:
    """Starts units in this order and waits until systemd reports each as started. Raises ``FailedError``."""
    if not units:
        return
    _call(["systemctl", "reset-failed", "--", *units], 20)
    trouble = ""
    try:
        _call(["systemctl", "start", "--", *units], 180)
    except FailedError as error:
        trouble = error.message
    unwell = ("failed", "activating") if trouble else ("failed",)
    broken = [unit for unit, state in states(units).items() if state["active"] in unwell]
    if broken:
        words = _last_words(broken[0])
        raise FailedError("{} did not start{}".format(", ".join(broken), f": {words}" if words else ""))
    if trouble:
        raise FailedError(trouble)


def _last_words(unit: str) -> str:
    """Returns the last log messages of a unit, on one line, without those of systemd itself."""
    command = ["journalctl", "--unit", unit, "--lines=40", "--output=json", "--no-pager", "--boot"]
    try:
        entries = [json.loads(line) for line in _call(command, 10).splitlines()]
    except (FailedError, ValueError):
        return ""
    messages = [str(one.get("MESSAGE", "")) for one in entries if one.get("SYSLOG_IDENTIFIER") != "systemd"]
    return " | ".join(line.strip() for line in messages[-_WORDS:] if line.strip())[-_LONGEST_WORDS:]


def journal(unit: str, since: float) -> str:
    """Returns the log of a unit since ``since`` (s since 1970)."""
    span = f"--since=@{since:.6f}"
    return _call(["journalctl", "--unit", unit, span, "--output=cat", "--no-pager", "--boot"], 20)


def forget(units: Sequence[str]) -> None:
    """Resets failed units that no longer exist: systemd lists them otherwise."""
    failed = [unit for unit, state in states(units).items() if state["active"] == "failed"]
    if failed:
        _call(["systemctl", "reset-failed", "--", *failed], 20)


def reload(home: Home, daemons: Sequence[str]) -> None:
    """Makes daemons read their files again; udev applies its rules to the devices present."""
    if "systemd" in daemons:
        _call(["systemctl", "daemon-reload"], 90)
    if "udev" in daemons and os.path.exists(home.outside("/run/udev/control")):
        _call(["udevadm", "control", "--reload"], 20)
        kinds = ("--subsystem-match=tty", "--subsystem-match=usb-serial")
        _call(["udevadm", "trigger", "--action=change", *kinds], 20)
        _call(["udevadm", "settle", "--timeout=10"], 20)
    for name, (unit, verb) in _SERVICES.items():
        # One that is stopped reads its file when it starts; one that failed may have died of what is undone.
        if name in daemons and states([unit])[unit]["active"] != "inactive":
            _call(["systemctl", "reset-failed", "--", unit], 20)
            _call(["systemctl", verb, "--", unit], 90)
