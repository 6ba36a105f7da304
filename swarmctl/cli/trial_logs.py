"""The logs of a trial: what the swarm's units on each host have logged meanwhile, as files of its capsule."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from swarmctl.cli import console
from swarmctl.health.host_logs import Merge, Question, host_logs
from swarmctl.remote.parallel_hosts import Finished
from swarmctl.remote.transport import HostError, Target, Transport
from swarmctl.views import logs as view
from swarmctl.views.escape import printable

if TYPE_CHECKING:
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


def text(log: HostLog, began: float, ended: float) -> str:
    """Returns what was logged from ``began`` to ``ended``, s since 1970 by the operator's clock."""
    merge = Merge()
    for entry in log.entries:
        if began <= entry.time <= ended:
            merge.add(entry, 0.0)
    return "".join(f"{view.dated(entry, log.offset)}\n" for entry in merge.rest())


def _warn(message: str) -> None:
    console.show(f"warning: {printable(message)}", error=True)
