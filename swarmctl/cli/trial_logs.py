"""What hosts have logged in a trial, and recorded of who commanded its robots, as files of its capsule."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from swarmctl.cli import console
from swarmctl.deploy.host_records import command_records
from swarmctl.health.host_logs import Merge, Question, host_logs
from swarmctl.plan.command_history import Record, Span, Start, events
from swarmctl.remote.parallel_hosts import Finished, results_of
from swarmctl.remote.transport import HostError, Target, Transport
from swarmctl.views import logs as view
from swarmctl.views.escape import printable

if TYPE_CHECKING:
    from swarm_onboard.common.record_chain import Head

    from swarmctl.health.host_logs import HostLog

_LINES = 10_000  # of each host, as `swarmctl logs` reads at most


def fetch(
    swarm: str,
    targets: Mapping[str, Target],
    transport: Transport,
    folder: Path,
    *,
    began: float,
    ended: float,
    parallel: int,
) -> None:
    """Writes ``HOST.log`` to ``folder`` for each host that answers; of others there is a warning.

    ``began`` and ``ended``: s since 1970 by the operator's clock.
    """
    question = Question(swarm, dict.fromkeys(targets, ()), _LINES, began)
    for event in host_logs(question, list(targets.values()), transport, parallel=parallel):
        if not isinstance(event, Finished):
            continue
        host, found = event.host, event.outcome
        if isinstance(found, HostError):
            _warn(f"no log of {host}: {found.message.removeprefix(f'{host}: ')}")
            continue
        if found.cut:
            _warn(f"{host} has logged more, only the newest are kept")
        try:
            folder.mkdir(exist_ok=True)
            (folder / f"{host}.log").write_text(text(found, began, ended), "utf-8")
        except OSError as error:
            _warn(f"no log of {host}: {console.cannot_write(error, folder)}")


def fetch_commands(
    swarm: str,
    targets: Mapping[str, Target],
    transport: Transport,
    file: Path,
    *,
    began: float,
    ended: float,
    ahead: Mapping[str, float],
    parallel: int,
) -> None:
    """Writes who commanded the robots, as `swarmctl history --commands --json` prints it, to ``file``.

    ``began`` and ``ended`` as above; ``ahead``: by how many s the clock of a host is ahead of it. A host that
    does not answer is a warning, and so is a record that proves nothing.
    """
    seen: Mapping[str, Mapping[str, Head]] = {host: {} for host in targets}
    read = command_records(swarm, list(targets.values()), transport, seen, parallel=parallel)
    records: dict[tuple[str, str], Record] = {}
    for host, found in results_of(read).items():
        if isinstance(found, HostError):
            _warn(f"not known who commanded robots of {host}: {found.message.removeprefix(f'{host}: ')}")
            continue
        records |= {(host, robot): record for robot, record in found.robots.items()}
    for (host, robot), record in records.items():
        if record.problem:
            _warn(f"the record of who commanded {robot} on {host} {record.problem}")
    rows = [
        one.to_json()
        for one in events(records)
        if _between(one.what, began + ahead.get(one.host, 0.0), ended + ahead.get(one.host, 0.0))
    ]
    try:
        file.write_text(json.dumps(rows, indent=1) + "\n", "utf-8")
    except OSError as error:
        _warn(f"{console.cannot_write(error, file)}")


def _between(what: Span | Start, began: float, ended: float) -> bool:
    if isinstance(what, Start):
        return began <= what.time <= ended
    if what.seconds is None:  # without its end it is of the trial only if it goes on, or began there
        return what.time <= ended and (what.ongoing or what.time >= began)
    return what.time <= ended and what.time + what.seconds >= began


def text(log: HostLog, began: float, ended: float) -> str:
    """Returns what was logged from ``began`` to ``ended``, s since 1970 by the operator's clock."""
    merge = Merge()
    for entry in log.entries:
        if began <= entry.time <= ended:
            merge.add(entry, 0.0)
    return "".join(f"{view.dated(entry, log.offset)}\n" for entry in merge.rest())


def _warn(message: str) -> None:
    console.show(f"warning: {printable(message)}", error=True)
