"""``probe``: how the host's part of the swarm is doing, without changing or joining anything.

The middleware's own module, which the request names, observes the graph. A part that fails does not affect
the others: the answer has it in ``troubles``, with the reason.
"""

from __future__ import annotations

import glob
import grp
import importlib
import os
import stat
import threading
import time
from collections.abc import Mapping, Sequence
from functools import partial

from swarm_onboard.agent import (
    deployed,
    images,
    lock,
    pings,
    process_environment,
    processes,
    requirements,
    stop_latches,
    systemd,
    unit_history,
)
from swarm_onboard.agent.deployed import Transaction
from swarm_onboard.agent.edits import Drift
from swarm_onboard.agent.errors import RefusedError, TimedOutError
from swarm_onboard.agent.images import Image
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.observations import (
    ConflictSeen,
    DeviceSeen,
    GraphSeen,
    LaunchedSeen,
    LoadSeen,
    MasterSeen,
    NodeSeen,
    PeerSeen,
    PingSeen,
    SenderSeen,
    SimulatedTimeSeen,
    UnconnectedSeen,
    UnmatchedSeen,
)
from swarm_onboard.agent.release_store import Home, home_of
from swarm_onboard.agent.rpc import Report
from swarm_onboard.agent.stop_latches import Latch
from swarm_onboard.agent.systemd import UnitState
from swarm_onboard.agent.texts import clipped

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Callable, Iterable

_MOST_NAMES = 20  # adapters on one host
_SERIAL_GROUP = "dialout"
_ASK_SYSTEMD = ("command_record", "override", "recovery")
_HISTORY = ("recent", "rejoined", "running", "starting", "log", "exit", "stopped")


class Request(NamedTuple):
    """What is to be looked at.

    ``module``: its ``observe(request, answer)`` returns the answer with what it sees of the graph, its
    ``observe_logs(answer)`` with the conflicts, after the last states of the units; ``master``: its URI,
    empty without one; ``nodes``: by name, the s to listen to each of its topics; ``parameters``: by name,
    those that the node has set, to be compared with what the master has; ``graph``: other islands are looked
    for, by their topics that are ``bridged`` here (None for all) and the addresses and names of this island's
    ``own`` hosts; ``commands``: topics whose publishers and subscribers are looked up, with those of all
    topics that have one of ``command_types``; ``publishers``: by topic, the nodes that should publish it;
    ``homes``: by node of the island, the address at which it should be, empty but on the hub; ``peers``:
    nodes on other hosts to which the master here connects; ``expected``: by node, or by unit whose nodes have
    no known names, what it ``publishes``, ``subscribes`` and ``provides``, which is waited for where nodes
    find each other without a master; ``skippable``: nodes that are not waited for while their unit, which it
    has for each, is skipped; ``inputs``: topics to whose publishers nodes of this host connect; ``provides``:
    services and actions that nodes of this host should have; ``launched``: units whose nodes are to be found,
    each with what these have, and the s to listen to that (0: not at all); ``advertised``: the host in the
    URIs of this host's nodes; ``restart_window``: s in which restarts count; ``images``: those of containers,
    by unit, each with its engine; ``checks``: modules of swarm_onboard.host_checks; ``clock``: s to listen to
    the clock of simulated time, 0 where time is not simulated, None where the host runs no master; ``pings``:
    addresses of other hosts, with the s for which they are pinged; ``requires``: what the units of the
    release need to start.
    """

    swarm: str
    module: str
    units: Sequence[str] = ()
    master: str = ""
    nodes: Mapping[str, Mapping[str, float]] = {}
    parameters: Mapping[str, Mapping[str, Any]] = {}
    graph: bool = False
    bridged: Sequence[str] | None = None
    own: Sequence[str] = ()
    commands: Sequence[str] = ()
    command_types: Sequence[str] = ()
    publishers: Mapping[str, Sequence[str]] = {}
    homes: Mapping[str, str] = {}
    peers: Sequence[str] = ()
    expected: Mapping[str, Mapping[str, Sequence[str]]] = {}
    skippable: Mapping[str, str] = {}
    inputs: Sequence[str] = ()
    provides: Sequence[str] = ()
    devices: Sequence[str] = ()
    launched: Mapping[str, Mapping[str, float]] = {}
    advertised: str = ""
    restart_window: float = 0.0
    images: Mapping[str, tuple[str, str]] = {}
    checks: Sequence[str] = ()
    clock: float | None = None
    pings: Mapping[str, float] = {}
    requires: Sequence[str] = ()


class Answer(NamedTuple):
    """What was seen. A missing part could not be determined; ``troubles`` may have the reason.

    ``troubles`` of the graph: ``ros``, ``commanders``, ``graph``, ``peers``, ``launched``, ``conflicts``,
    ``simulated time``.
    """

    troubles: Mapping[str, str] = {}
    release: str | None = None
    units: Mapping[str, UnitState] = {}
    since: Mapping[str, float] = {}  # when restarts count from, by unit, s since 1970
    master: MasterSeen | None = None
    nodes: Mapping[str, NodeSeen] = {}
    launched: Mapping[str, LaunchedSeen] = {}  # by unit
    conflicts: Mapping[str, Mapping[str, ConflictSeen]] = {}  # by unit and node
    commanders: Mapping[str, Sequence[str]] = {}
    receivers: Mapping[str, Sequence[str]] = {}
    others: Mapping[str, Sequence[str]] = {}  # nodes that publish a topic and should not, by topic
    peers: Mapping[str, PeerSeen] = {}  # by node
    unconnected: Sequence[UnconnectedSeen] = ()
    listening: Sequence[int] = ()  # ports of the host on which a process listens
    listening_udp: Sequence[int] = ()
    seen: int | None = None  # nodes in the graph, where nodes find each other without a master
    incomplete: bool = False  # something expected was not among them, and the graph still changed
    doubles: Mapping[str, Sequence[str]] = {}  # hosts, empty if unknown, by name of several nodes
    unmatched: Sequence[UnmatchedSeen] = ()
    senders: Mapping[str, SenderSeen] = {}
    graph: GraphSeen | None = None
    simulated_time: SimulatedTimeSeen | None = None
    devices: Mapping[str, DeviceSeen] = {}
    environments: Mapping[str, Sequence[str]] = {}  # ROS variables that differ from the release, by unit
    latches: Mapping[str, Latch] = {}  # by robot
    change: Transaction | None = None
    holder: str | None = None  # who changes the host now
    drift: Drift | None = None
    lacks: Sequence[str] | None = None  # of what its release requires
    checks: Mapping[str, Sequence[Any]] = {}  # by name of a host's check
    load: LoadSeen | None = None
    pings: Mapping[str, PingSeen] = {}  # by address
    images: Mapping[str, Image] = {}  # by unit
    boot_id: str = ""
    time: float | None = None  # of the host's clock, s since 1970
    clock_ahead: float | None = None  # s, against the clock of the operator, who adds it


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Returns what runs on the host. A part that fails is missing in the answer."""
    home = home_of(request.swarm)
    troubles: dict[str, str] = {}
    middleware = partial(importlib.import_module, request.module)

    def part(name: str, find: Callable[[], Any], missing: Any = None) -> Any:
        try:
            return find()
        except RefusedError as error:
            troubles[name] = clipped(error.message, 300)
        except Exception as error:  # noqa: BLE001  (whatever it is, it must not take the other parts' answers away)
            troubles[name] = clipped(f"{type(error).__name__}: {error}")
        return missing

    def states() -> dict[str, UnitState]:
        try:
            return systemd.states([str(unit) for unit in request.units])
        except TimedOutError:
            troubles["systemd"] = "does not answer"
            return {}

    pinging = part("pings", lambda: pings.Pings(request.pings))
    work = part("load", processes.processor_work)
    before = part("units", states, {})
    if "systemd" in troubles:
        others = [check for check in request.checks if check not in _ASK_SYSTEMD]
        request = request._replace(units=[], launched={}, checks=others)
    known, looked = Answer(units=before), []
    look = partial(part, "ros", lambda: middleware().observe(request, known), known)
    looking = threading.Thread(target=lambda: looked.append(look()), daemon=True)
    looking.start()
    window = float(request.restart_window)
    before, since = part("journal", lambda: unit_history.with_restarts(home, before, window), (before, {}))
    before = part("processes", lambda: unit_history.with_stopped(before), before)
    checks = {name: part(name, partial(_observed, name, home)) for name in request.checks}
    parts = {
        "since": since,
        "environments": part("environments", lambda: process_environment.differences(home, before), {}),
        "images": part(
            "images", lambda: {unit: images.look(*one) for unit, one in request.images.items()}, {}
        ),
        "release": part("release", home.current),
        "change": part("change", lambda: deployed.last_change(home)),
        "holder": part("change", lambda: lock.holder(home)),
        "drift": part("files", lambda: _drift(home)),
        "lacks": part("requirements", lambda: _lacks(request.requires, home)),
        "checks": {name: found for name, found in checks.items() if found is not None},
        "latches": part("latches", lambda: stop_latches.closed(home), {}),
        "devices": part("devices", lambda: {path: device(path) for path in request.devices}, {}),
    }
    looking.join()
    answer = looked[0]._replace(
        **parts,
        pings=part("pings", pinging.counts, {}) if pinging else {},
        load=part("load", lambda: processes.processor_work().since(work)) if work else None,
        units=_with_restarts(before, part("units", states, {})),
    )
    observed: Answer = part("conflicts", lambda: middleware().observe_logs(answer), answer)
    boot_id = part("boot_id", _boot_id, "")
    return observed._replace(boot_id=boot_id, time=time.time(), troubles={**observed.troubles, **troubles})


def _observed(check: str, home: Home) -> list[Any]:
    module = importlib.import_module(f"swarm_onboard.host_checks.{check}")
    return list(module.observe(home))


def _lacks(requires: Iterable[str], home: Home) -> list[str]:
    places = requirements.found(requires, home.outside)
    return [one for one in requires if not places.get(one)]


def _drift(home: Home) -> Drift | None:
    digest = home.current()
    if digest is None:
        return None
    return deployed.drift(home, digest, home.known_manifest(digest))


def _with_restarts(before: Mapping[str, UnitState], after: Mapping[str, UnitState]) -> dict[str, UnitState]:
    """The states of now, with how often each unit was restarted while the probe looked.

    That counts a restart which was under way when it began.
    """
    return {
        unit: state._replace(
            restarted=max(0, state.restarts - before[unit].restarts + _starts_again(before[unit])),
            **{name: getattr(before[unit], name) for name in _HISTORY},
        )
        for unit, state in after.items()
        if unit in before
    }


def _starts_again(state: UnitState) -> bool:
    """Returns True if systemd has counted its restart, and it does not run yet."""
    starting = state.active == "activating" and state.sub != "auto-restart"
    return bool(starting and state.restarts)


def _boot_id() -> str:
    with open("/proc/sys/kernel/random/boot_id", encoding="ascii") as file:
        return file.read().strip()


def device(path: str) -> DeviceSeen:
    """Whether a serial device is there and open to drivers; where it is not, what else is."""
    try:
        status = os.stat(path)
    except OSError:
        nearby = sorted(os.path.basename(one) for one in glob.glob("/dev/serial/by-id/*"))
        return DeviceSeen(False, nearby=[clipped(one) for one in nearby[:_MOST_NAMES]])
    try:
        group = grp.getgrgid(status.st_gid).gr_name
    except KeyError:
        group = str(status.st_gid)
    return DeviceSeen(
        True,
        is_device=stat.S_ISCHR(status.st_mode),
        usable=group == _SERIAL_GROUP and status.st_mode & 0o060 == 0o060,
        resolves=os.path.realpath(path),
        group=group,
        mode=stat.S_IMODE(status.st_mode),
    )
