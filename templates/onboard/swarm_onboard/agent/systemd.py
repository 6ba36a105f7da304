"""systemd, udev and other services, by their commands, each with a timeout."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Sequence

from . import conditions
from .errors import FailedError, TimedOutError
from .named_tuple import NamedTuple
from .release_store import Home
from .texts import clipped

_STATE = ("Id", "LoadState", "ActiveState", "SubState", "Result", "StatusText", "MainPID", "NRestarts")
_RESTART_RECORDS = "/run/swarm-restarts"  # of bin/restart-delay
_CONDITION = ("ConditionResult", "ConditionTimestampMonotonic")
_ADDRESSES = ("IPAddressDeny", "IPAccounting", "IPIngressBytes")
_ANSWERS_WITHIN = 10.0  # s
_NOT_COUNTED = ("[no data]", str(2**64 - 1))  # by the version of systemctl


class UnitState(NamedTuple):
    """A systemd unit as ``systemctl show`` reports it, and what a probe adds to that.

    ``skipped``: it does not run, as a condition of the unit was checked and not met; ``unmet``: those that
    are not met now, as its file has them, such as ``ConditionPathExists=/sys/class/bluetooth/hci0``.
    ``unenforced``: it runs, and systemd does not enforce its ``IPAddressDeny=``.
    ``restarted``: how often while it was probed; ``recent`` restarts, and ``rejoined`` those that followed a
    new ROS master, of which none is recent. ``running``: for how long a unit that was restarted has run by
    now, s; ``starting``: for how long one that was not restarted has been starting, s.
    ``exit``: how its main process ended last; ``log``: the end of its log if it does not run; ``stopped``:
    processes that a signal or a debugger has stopped, as number and name; ``error``: it runs, and reports
    in ``text`` why it cannot do its task.
    """

    load: str
    active: str
    sub: str
    result: str
    text: str
    pid: int
    restarts: int
    restarted: int = 0
    skipped: bool = False
    recent: int = 0
    rejoined: int = 0
    running: float = 0.0
    starting: float = 0.0
    log: str = ""
    exit: str = ""
    stopped: Sequence[str] = ()
    unmet: Sequence[str] = ()
    unenforced: bool = False
    error: bool = False

    @property
    def ended(self) -> bool:
        """Returns True if it ended by itself, and systemd starts it again or has given up."""
        return self.active == "failed" or self.sub == "auto-restart" or self.restarted > 0

    @property
    def runs(self) -> bool:
        """Returns True if systemd reports the unit as active or reloading."""
        return self.active in ("active", "reloading")

    @property
    def up(self) -> bool:
        """Returns True if it runs, or is starting."""
        return self.runs or self.active == "activating"


def present(home: Home) -> bool:
    """Returns True if the host runs systemd."""
    return os.path.isdir(home.outside("/run/systemd/system"))


def call(command: Sequence[str], timeout: float) -> str:
    """Returns what a command prints. Raises ``FailedError``; ``TimedOutError`` after ``timeout`` s."""
    import subprocess  # noqa: PLC0415  (takes long to load, and the states of units are read without it)

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
        raise TimedOutError("`{}` did not end within {:g} s".format(" ".join(command), timeout)) from None
    except OSError as error:
        raise FailedError(f"`{command[0]}` cannot be run: {error}") from error
    if done.returncode != 0:
        complaint = done.stderr.decode("utf-8", "replace").strip() or f"status {done.returncode}"
        raise FailedError("`{}` failed: {}".format(" ".join(command), " ".join(complaint.split())))
    return done.stdout.decode("utf-8", "replace")


def states(units: Sequence[str]) -> dict[str, UnitState]:
    """Returns the state of each unit."""
    found = {
        unit: _state(values)
        for unit, values in properties(units, (*_STATE, *_CONDITION, *_ADDRESSES, "StatusErrno")).items()
    }
    skipped = [unit for unit, state in found.items() if state.skipped]
    for unit, values in properties(skipped, ("Id", "FragmentPath")).items():
        found[unit] = found[unit]._replace(unmet=conditions.unmet(values.get("FragmentPath", "")))
    return found


def _state(values: dict[str, str]) -> UnitState:
    _, load, active, sub, result, text, pid, restarts = (values.get(name, "") for name in _STATE)
    met, looked = (values.get(name, "") for name in _CONDITION)
    unmet = met == "no" and looked not in ("", "0")
    denied, counts, received = (values.get(name, "") for name in _ADDRESSES)
    # The BPF program that enforces the list counts the bytes, too.
    filtered = not denied or counts != "yes" or received not in _NOT_COUNTED
    return UnitState(
        load,
        active,
        sub,
        result,
        clipped(text),  # written by the unit itself
        int(pid or 0),
        int(restarts or 0),
        skipped=active == "inactive" and (unmet or result == "exec-condition"),
        unenforced=int(pid or 0) != 0 and not filtered,
        error=values.get("StatusErrno", "0") != "0",
    )


def properties(units: Sequence[str], names: Sequence[str]) -> dict[str, dict[str, str]]:
    """Returns the properties ``names`` of each unit, named as in ``systemctl show``. ``Id`` is one."""
    if not units:
        return {}
    output = call(["systemctl", "show", "--no-pager", "-p", ",".join(names), "--", *units], _ANSWERS_WITHIN)
    paragraphs = output.strip("\n").split("\n\n")
    return {
        unit: dict(line.split("=", 1) for line in paragraph.splitlines() if "=" in line)
        for unit, paragraph in zip(units, paragraphs)
    }


def active_for(units: Sequence[str]) -> dict[str, float]:
    """Returns for how many s each unit has been active; for one that is not, the value has no meaning."""
    name = "ActiveEnterTimestampMonotonic"  # microseconds of CLOCK_MONOTONIC
    now = time.monotonic()
    found = properties(units, ("Id", name))
    return {unit: now - int(values.get(name) or 0) / 1e6 for unit, values in found.items()}


def running(units: Sequence[str]) -> list[str]:
    """Returns those of ``units`` that run or start."""
    known = states(units)
    return [unit for unit in units if known[unit].active not in ("inactive", "failed")]


def stop(units: Sequence[str]) -> None:
    """Stops units together; a unit unknown to systemd counts as stopped."""
    known = states(units)
    loaded = [u for u in units if known[u].load != "not-found" or known[u].active != "inactive"]
    if loaded:
        call(["systemctl", "stop", "--", *loaded], 90)


def queue_start(units: Sequence[str]) -> None:
    """Queues the start of units, with all that they want; waits for none."""
    if units:
        call(["systemctl", "start", "--no-block", "--", *units], 20)


def journal(unit: str, since: float) -> str:
    """Returns the log of a unit since ``since`` (s since 1970)."""
    span = f"--since=@{since:.6f}"
    return call(["journalctl", "--unit", unit, span, "--output=cat", "--no-pager", "--boot"], 20)


def forget(units: Sequence[str]) -> None:
    """Resets failed units that no longer exist, which systemd lists otherwise, and how often units ended."""
    failed = [unit for unit, state in states(units).items() if state.active == "failed"]
    if failed:
        call(["systemctl", "reset-failed", "--", *failed], 20)
    for unit in units:
        with contextlib.suppress(OSError):
            os.unlink(os.path.join(_RESTART_RECORDS, unit))
    with contextlib.suppress(OSError):  # another swarm may have some
        os.rmdir(_RESTART_RECORDS)
