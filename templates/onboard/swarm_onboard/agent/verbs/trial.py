"""``trial``: at an instant by the clock of the host, start programs anew and release robots, for a time."""

from __future__ import annotations

import time
from contextlib import contextmanager

from swarm_onboard.agent import (
    bags,
    boot,
    disk,
    lease,
    lock,
    recovery_unit,
    robot_motion,
    stop_latches,
    systemd,
    trial_guard,
    trial_units,
)
from swarm_onboard.agent.errors import FailedError, RefusedError, TimedOutError
from swarm_onboard.agent.manifest import unit_names
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.release_store import Home, home_of
from swarm_onboard.agent.rpc import Report
from swarm_onboard.agent.texts import clipped
from swarm_onboard.agent.verbs import costs as unit_costs

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Iterator

_AHEAD = 30.0  # s, at most
_LONGEST = 1e6  # s
_GRACE = 1.0  # s
_LAST = 0.05  # s before the instant: from here on nobody is waited for
_LOOK, _FINE = 0.25, 0.0003  # s
_ANSWERS_WITHIN = 0.2  # s
_LATER = "start the trial again, with more time before its start"
_AGAIN = "`swarmctl stop SPEC` stops all robots; then start the trial again"


class Request(NamedTuple):
    """At ``at``, s since 1970, release ``robots`` for ``seconds`` and start ``units``, stopped until then.

    ``once``: units that run in trials alone, and end with this one; with ``at`` 0 they end, and nothing
    else is done: then ``ended`` is about them. ``name``: of the trial, for people.
    """

    swarm: str
    who: str
    robots: list[str]
    units: list[str]
    once: list[str]
    at: float
    seconds: float
    name: str = ""
    wait: float = 2.0
    run: str = ""


class Answer(NamedTuple):
    """``clock``: that of the host, in s since 1970, when it had the request.

    ``began``: when the latches of the robots ``released`` were open; ``restarted``: units. Where nothing is
    started, ``released`` are the robots of the trial that goes on which nobody has stopped, and ``ended``
    its units that run in trials alone and have ended, each with systemd's result; ``free`` are bytes where
    bags are recorded, ``batteries`` how full those are that a driver or a gate knows, 0 to 1, and ``costs``
    what the units of the swarm have taken so far.
    """

    deployed: bool
    clock: float
    began: float
    released: list[str]
    restarted: list[str]
    ended: dict[str, str]
    free: int
    batteries: dict[str, float]
    costs: unit_costs.Answer | None


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Starts a trial at its instant. Raises ``RefusedError`` and ``FailedError``: no robot is released then.

    A guard latches the robots, and ends the units that run in trials alone, when the time of the trial is
    over, whoever is gone by then.
    """
    clock = time.time()
    home = home_of(request.swarm)
    deployed = home.current() is not None
    if not request.at or not deployed:
        trial_units.end(home, _own(home, request.once))
        ended = trial_units.ended(request.once) if request.once else trial_guard.ended(home)
        free = disk.free(disk.file_system(bags.folder(home)))
        taken = unit_costs.handle(unit_costs.Request(request.swarm), b"", report)
        released = trial_guard.released(home)
        return Answer(deployed, clock, 0.0, released, [], ended, free, _batteries(home), taken)
    with lease.held_for(home, request):
        latched = _checked(home, request)
        with _stopped(home, request):
            with _guarded(home, request):
                _wait(request.at - _LAST)
                report.note("starts")  # fails if the operator has gone
                report.detach()
                _wait(request.at)
                if stop_latches.stamps(home, request.robots) != latched:
                    raise RefusedError("a robot was stopped, or released, before the start", _AGAIN)
                trial_units.allow(home, request.once)
            released = stop_latches.release(home, request.robots, synced=False)
            began = time.time()
            robot_motion.wake(home, released)
    return Answer(True, clock, began, released, [*request.units, *request.once], {}, 0, {}, None)


def _batteries(home: Home) -> dict[str, float]:
    sockets = robot_motion.sockets(home)
    answers = robot_motion.ask(sockets, _ANSWERS_WITHIN, lambda found: len(found) == len(sockets))
    shares = {robot: answer.get("battery") for robot, answer in answers.items()}
    return {robot: float(share) for robot, share in shares.items() if isinstance(share, (int, float))}


def _own(home: Home, units: list[str]) -> list[str]:
    """Returns units of the release that runs here. Raises ``RefusedError`` for another."""
    own = {one["name"] for one in home.units(home.current())} if units else set()
    if foreign := set(unit_names(units)) - own:
        names = ", ".join(sorted(foreign))
        raise RefusedError(
            f"not in the release that runs here: {names}", "deploy, then start the trial again"
        )
    return units


def _checked(home: Home, request: Request) -> dict[str, int]:
    """The stamps of the robots' latches. Raises ``RefusedError`` for a request that cannot be met."""
    robots = stop_latches.robot_names(request.robots)
    _own(home, [*request.units, *request.once])
    others = [one for one in trial_guard.released(home) if one not in robots]
    if others and (robots or request.once):
        raise RefusedError(
            f"{others[0]} drives in another trial here", "wait for its end, or stop its robots"
        )
    latched = stop_latches.stamps(home, robots)
    if free := [one for one in robots if one not in latched]:
        raise RefusedError(f"not stopped: {', '.join(free)}", "`swarmctl stop SPEC` stops robots")
    if not 0 < request.seconds <= _LONGEST:
        raise RefusedError(f"a trial cannot last {request.seconds:g} s", f"up to {_LONGEST:g} s are possible")
    left = request.at - time.time()
    if not 0 <= left <= _AHEAD:
        when = f"{-left:.3f} s ago" if left < 0 else f"in {left:.3f} s"
        raise RefusedError(
            f"by the clock of this host the trial starts {when}",
            f"the start must be 0 to {_AHEAD:g} s ahead; `swarmctl status SPEC` shows clocks that differ",
        )
    return latched


@contextmanager
def _stopped(home: Home, request: Request) -> Iterator[None]:
    """Stops units before the instant, and starts them after the block.

    If that fails, it starts those that run outside of trials as well.
    """
    starting = request.units
    try:
        if stopping := [*request.units, *request.once]:
            _stop(stopping, request.at - time.time())
        yield
        starting = stopping
    except BaseException:
        trial_units.forbid(home, request.once)
        raise
    finally:
        systemd.queue_start(starting)


def _stop(units: list[str], seconds: float) -> None:
    try:
        systemd.call(["systemctl", "stop", "--", *units], max(0.0, seconds))
    except TimedOutError as error:
        raise FailedError(f"programs did not end before the start: {error}", _LATER) from error


@contextmanager
def _guarded(home: Home, request: Request) -> Iterator[None]:
    """Arms the guard of the trial; disarms it if the block fails."""
    armed = False
    try:
        if request.robots or request.once:
            recovery_unit.install(home)
            trial = trial_guard.trial_of(
                home,
                clipped(request.name),
                lock.operator_in(request),
                robots=request.robots,
                units=request.once,
                seconds=request.at - time.time() + request.seconds + trial_guard.GRACE,
            )
            armed = True
            trial_guard.arm(home, trial)
        if time.time() > request.at:
            raise FailedError("this host was not ready before the start", _LATER)
        yield
    except BaseException:
        if armed:
            trial_guard.disarm(home)
        raise


def _wait(moment: float) -> None:
    """Returns at ``moment`` by the host's clock. Raises ``FailedError`` if that is set back meanwhile."""
    latest = boot.now() + moment - time.time() + _GRACE
    while (left := moment - time.time()) > 0:
        if boot.now() > latest:
            raise FailedError("the clock of this host was set back before the start", "start the trial again")
        time.sleep(max(0.0, min(left - _FINE, _LOOK)))
