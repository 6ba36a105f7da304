"""``remove``: take the swarm off the host."""

from __future__ import annotations

import os
from contextlib import suppress

from swarm_onboard.agent import lease, lock, motion_gate, recovery_unit, wireguard_key, withdrawal
from swarm_onboard.agent.errors import FailedError
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report


class Request(NamedTuple):
    """Take the swarm off the host."""

    swarm: str
    who: str = ""
    wait: float = 2.0
    run: str = ""
    stop_robots: bool = False


class Answer(NamedTuple):
    """``removed``: whether it was there."""

    removed: bool


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Takes the swarm off the host. Raises ``RefusedError`` and ``FailedError``."""
    home = home_of(request.swarm)
    if not os.path.isdir(home.path):
        wireguard_key.forget(home)  # it is there before the first deploy
        return Answer(False)
    with lease.held_for(home, request):
        manifest = home.known_manifest(home.current())
        units, who = manifest.units if manifest else [], lock.operator_in(request)
        motion_gate.clear(home, units, stop=bool(request.stop_robots), who=who, note=report.note)
        report.detach()
        with suppress(OSError, FailedError):  # a swarm can be removed from a full disk, too
            recovery_unit.install(home)
            recovery_unit.watch(home)
        withdrawal.withdraw(home, lock.operator_in(request), report.note)
    return Answer(True)
