"""``probe``: how the host's part of the swarm is doing, without changing or joining anything.

The middleware's own module, which ``ProbeRequest`` names, observes the graph. A part that fails does not
affect the others: the answer has it in ``troubles``, with the reason.
"""

from __future__ import annotations

import glob
import grp
import importlib
import os
import stat
import time
from functools import partial

from swarm_onboard.agent import (
    deployed,
    images,
    lock,
    pings,
    process_environment,
    processor_work,
    requirements,
    stop_latches,
    systemd,
    unit_history,
)
from swarm_onboard.agent.clip import clipped
from swarm_onboard.agent.errors import RefusedError, TimedOutError
from swarm_onboard.agent.release_store import Home, home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Callable, Iterable, Mapping

    from swarm_onboard.agent.probe_messages import DeviceAnswer, ProbeAnswer, ProbeRequest

_MOST_NAMES = 20  # adapters on one host
_SERIAL_GROUP = "dialout"
_ASK_SYSTEMD = ("command_record", "override", "recovery")


def handle(request: ProbeRequest, payload: bytes, report: Report) -> ProbeAnswer:
    """Returns what runs on the host. A part that fails is missing in the answer."""
    home = home_of(request["swarm"])
    answer: ProbeAnswer = {"troubles": {}}

    def part(name: str, find: Callable[[], Any]) -> Any:
        try:
            return find()
        except RefusedError as error:
            answer["troubles"][name] = clipped(error.message, 300)
        except Exception as error:  # noqa: BLE001  (whatever it is, it must not take the other parts' answers away)
            answer["troubles"][name] = clipped(f"{type(error).__name__}: {error}")
        return None

    def states() -> dict[str, systemd.UnitState] | None:
        try:
            return systemd.states([str(unit) for unit in request["units"]])
        except TimedOutError:
            answer["troubles"]["systemd"] = "does not answer"
            return None

    pinging = part("pings", lambda: pings.Pings(request["pings"]))
    work = part("load", processor_work.work)
    before = part("units", states)
    if "systemd" in answer["troubles"]:
        others = [check for check in request["checks"] if check not in _ASK_SYSTEMD]
        request = {**request, "units": [], "launched": {}, "checks": others}
    answer["history"] = part(
        "journal", lambda: unit_history.restarts(home, before or {}, float(request["restart_window"]))
    )
    answer["stopped"] = part("processes", lambda: unit_history.stopped(list(before or {})))
    answer["environments"] = part("environments", lambda: process_environment.differences(home, before or {}))
    answer["images"] = part(
        "images", lambda: {unit: images.look(*one)._asdict() for unit, one in request["images"].items()}
    )
    answer["release"] = part("release", home.current)
    answer["change"] = part(
        "change", lambda: {**deployed.last_change(home)._asdict(), "holder": lock.holder(home)}
    )
    answer["drift"] = part("files", lambda: _drift(home))
    answer["lacks"] = part("requirements", lambda: _lacks(request["requires"], home))
    checks = {name: part(name, partial(_observed, name, home)) for name in request["checks"]}
    answer["checks"] = {name: found for name, found in checks.items() if found is not None}
    answer["latches"] = part(
        "latches", lambda: {name: one._asdict() for name, one in stop_latches.closed(home).items()}
    )
    answer["devices"] = part("devices", lambda: {path: device(path) for path in request["devices"]})
    part("ros", lambda: importlib.import_module(request["module"]).observe(request, answer))
    answer["pings"] = part("pings", pinging.counts) if pinging else None
    answer["load"] = part("load", lambda: processor_work.work().since(work)) if work else None
    answer["units"] = _with_restarts(before, part("units", states))
    part("conflicts", lambda: importlib.import_module(request["module"]).observe_logs(answer))
    answer["boot_id"] = part("boot_id", _boot_id)
    answer["time"] = time.time()
    return answer


def _observed(check: str, home: Home) -> list[dict[str, Any]]:
    module = importlib.import_module(f"swarm_onboard.host_checks.{check}")
    return [one._asdict() for one in module.observe(home)]


def _lacks(requires: Iterable[str], home: Home) -> list[str]:
    places = requirements.found(requires, home.outside)
    return [one for one in requires if not places.get(one)]


def _drift(home: Home) -> dict[str, Any] | None:
    digest = home.current()
    if digest is None:
        return None
    return deployed.drift(home, digest, home.known_manifest(digest))._asdict()


def _with_restarts(
    before: Mapping[str, systemd.UnitState] | None, after: Mapping[str, systemd.UnitState] | None
) -> dict[str, Any] | None:
    """The states of now, with how often each unit was restarted while the probe looked.

    That counts a restart which was under way when it began.
    """
    if before is None or after is None:
        return None
    return {
        unit: state._replace(
            restarted=max(0, state.restarts - before[unit].restarts + _starts_again(before[unit]))
        )._asdict()
        for unit, state in after.items()
    }


def _starts_again(state: systemd.UnitState) -> bool:
    """Returns True if systemd has counted its restart, and it does not run yet."""
    starting = state.active == "activating" and state.sub != "auto-restart"
    return bool(starting and state.restarts)


def _boot_id() -> str:
    with open("/proc/sys/kernel/random/boot_id", encoding="ascii") as file:
        return file.read().strip()


def device(path: str) -> DeviceAnswer:
    """Whether a serial device is there and open to drivers; where it is not, what else is."""
    try:
        status = os.stat(path)
    except OSError as error:
        nearby = sorted(os.path.basename(one) for one in glob.glob("/dev/serial/by-id/*"))
        return {
            "exists": False,
            "error": str(error.strerror),
            "nearby": [clipped(one) for one in nearby[:_MOST_NAMES]],
        }
    try:
        group = grp.getgrgid(status.st_gid).gr_name
    except KeyError:
        group = str(status.st_gid)
    return {
        "exists": True,
        "resolves": os.path.realpath(path),
        "is_device": stat.S_ISCHR(status.st_mode),
        "usable": group == _SERIAL_GROUP and status.st_mode & 0o060 == 0o060,
        "group": group,
        "mode": stat.S_IMODE(status.st_mode),
    }
