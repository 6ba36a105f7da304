"""The guard of a trial latches its robots again, and ends its units, once the time of the trial is over.

A program of its own, in a systemd unit: it goes on without the operator. What it has to do is in a file, so
that systemd can start it again, and the recovery unit latches the robots if the host boots meanwhile.
"""

from __future__ import annotations

import os
import sys
import time

from swarm_onboard.common.systemd import Notifier

from . import boot, files, robot_motion, stop_latches, systemd, trial_units
from .errors import FailedError, RefusedError
from .named_tuple import NamedTuple
from .release_store import Home, home_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Iterable

GRACE = 1.0  # s after a trial for the operator to stop the robots
_LOOK = 0.5  # s between two looks at the latches
_STOP = 3.0  # s for robots to stand
_CODE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


class Trial(NamedTuple):
    """At ``until``, s since the boot ``boot_id``, ``robots`` are latched for ``who``, and ``units`` end.

    ``name`` is for people.
    """

    name: str
    who: str
    robots: list[str]
    units: list[str]
    boot_id: str
    until: float

    def left(self, home: Home) -> float:
        """Returns the s until then; 0 if that has passed, or the host restarted."""
        return max(0.0, self.until - boot.now()) if self.boot_id == boot.identity(home) else 0.0


def unit(home: Home) -> str:
    """Returns the name of the unit. No unit of a swarm has such a one."""
    return f"swarm-trial@{home.swarm}.service"


def trial_of(
    home: Home, name: str, who: str, *, robots: list[str], units: list[str], seconds: float
) -> Trial:
    """Returns a trial that ends after ``seconds``."""
    return Trial(name, who, robots, units, boot.identity(home), boot.now() + seconds)


def arm(home: Home, trial: Trial) -> None:
    """Starts the guard, in place of that of an earlier trial, whose units end, and returns once it runs.

    Raises ``FailedError`` and ``OSError``.
    """
    systemd.stop([unit(home)])
    earlier = _read(home)
    if earlier is not None and trial.boot_id == earlier.boot_id:
        trial_units.end(home, [one for one in earlier.units if one not in trial.units])
    files.write_json(home.trial_file, trial._asdict())
    properties = {
        "Type": "notify",
        "Environment": f"PYTHONPATH={_CODE} PYTHONDONTWRITEBYTECODE=1",
        "Restart": "on-failure",
        "RestartSec": "1",
        "StartLimitIntervalSec": "0",
    }
    systemd.call(
        [
            *("systemd-run", "--quiet", "--collect", f"--unit={unit(home)}"),
            f"--description=Guard of a trial of swarm {home.swarm}",
            *(f"--property={name}={value}" for name, value in properties.items()),
            *("--", sys.executable, "-S", "-s", "-m", __name__, home.swarm),
        ],
        20,
    )


def ended(home: Home) -> dict[str, str]:
    """Returns the units of the trial that goes on that have ended, each with systemd's result."""
    trial = going_on(home)
    return trial_units.ended(trial.units) if trial is not None else {}


def disarm(home: Home) -> None:
    """Ends the guard, which latches nothing then, and ends no unit."""
    files.remove(home.trial_file)


def going_on(home: Home) -> Trial | None:
    """Returns the trial that goes on; none after its time, or after a boot in it."""
    trial = _read(home)
    return trial if trial is not None and trial.left(home) else None


def released(home: Home) -> list[str]:
    """Returns the robots that nobody has stopped in the trial that goes on."""
    trial = going_on(home)
    if trial is None:
        return []
    latched = stop_latches.stamps(home, trial.robots)
    return [one for one in trial.robots if one not in latched]


def leave(home: Home, robots: Iterable[str]) -> None:
    """Takes robots that a person has released out of the trial: they drive on after it."""
    trial = _read(home)
    if trial is not None and set(robots).intersection(trial.robots):
        left = [one for one in trial.robots if one not in set(robots)]
        if left or trial.units:
            files.write_json(home.trial_file, trial._replace(robots=left)._asdict())
        else:
            disarm(home)


def settle(home: Home) -> None:
    """Latches the robots of a trial that a boot has interrupted. Raises ``FailedError`` and ``OSError``."""
    trial = _read(home)
    if trial is not None and trial.boot_id != boot.identity(home):
        _latch(home, trial)
        disarm(home)


def run(home: Home) -> None:
    """Returns once the trial is over: its robots are latched, by the operator or by this; its units ended.

    Without robots it is over after its time.
    """
    opened = False
    while True:
        trial = _read(home)
        if trial is None:
            return
        latched = set(stop_latches.stamps(home, trial.robots)) == set(trial.robots)
        if not trial.left(home) or (trial.robots and opened and latched):
            try:
                _latch(home, trial)
            finally:
                trial_units.end(home, trial.units)
            disarm(home)
            return
        opened = opened or not latched
        time.sleep(min(_LOOK, trial.left(home)))


def _read(home: Home) -> Trial | None:
    raw = files.read_json(home.trial_file)
    return Trial(**raw) if isinstance(raw, dict) and set(raw) == set(Trial._fields) else None


def _latch(home: Home, trial: Trial) -> None:
    failed = stop_latches.close(home, trial.robots, stop_latches.Latch(trial.who, round(time.time(), 3)))
    sockets = robot_motion.sockets(home)
    running = {one: sockets[one] for one in trial.robots if one in sockets}
    robot_motion.ask(running, _STOP, lambda found: robot_motion.proven(found, running))
    stop_latches.sync(home, trial.robots)
    if failed:
        raise FailedError("; ".join(failed.values()), "repair the disk")


if __name__ == "__main__":
    Notifier().ready()
    try:
        run(home_of(sys.argv[1]))
    except (OSError, RefusedError) as error:
        sys.exit(f"the trial has not ended: {error}")
