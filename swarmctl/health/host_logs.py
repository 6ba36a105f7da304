"""Reads the journal of the swarm's units from hosts; bounded there, so that none fills the memory here."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

from swarmctl.health.log_entries import Entry, parse
from swarmctl.remote import parallel_hosts
from swarmctl.remote.agent_client import printable
from swarmctl.remote.parallel_hosts import Event
from swarmctl.remote.transport import HostError, Kind, Session, Target, Transport

MOST_BYTES = 4 << 20  # of one host: the newest
_NO_UNITS = b"No data available"  # what journalctl says of a pattern that no unit in the journal matches
_LONGEST_ERROR = 300  # characters


@dataclass(frozen=True)
class HostLog:
    """What one host has logged; ``offset`` is how far its clock is ahead, in s; ``cut`` if there was more."""

    entries: list[Entry]
    offset: float
    cut: bool


def command(swarm: str, lines: int) -> str:
    """The command that prints a line, for a line its clock, and for a time by this clock its journal."""
    script = (
        "echo; read -r _; date +%s.%N; read -r since; "
        '[ "$(id -u)" = 0 ] || sudo="sudo -n"; '
        # With --since, -n would print the oldest.
        f'if [ "$since" = 0 ]; then set -- -n {lines}; else set -- --since "@$since"; fi; '
        f'$sudo journalctl -q --no-pager -o json "$@" -u "swarm-{swarm}.*" '
        f"--output-fields=MESSAGE,PRIORITY,UNIT,_SYSTEMD_UNIT | tail -n {lines} | tail -c {MOST_BYTES}"
    )
    return f"exec /bin/sh -c '{script}'"


def host_log(session: Session, host: str, swarm: str, lines: int, since: float) -> HostLog:
    """The last ``lines`` of a host since ``since``, in s by the operator's clock. Raises ``HostError``."""
    with session.channel(command(swarm, lines), limit=MOST_BYTES + 1024) as channel:  # type: ignore[union-attr]
        channel.exchange([], lambda piece: b"\n" in piece)
        sent = time.time()
        clock = channel.exchange([b"\n"], lambda piece: b"\n" in piece).stdout
        middle = (sent + time.time()) / 2
        try:
            offset = float(clock) - middle
        except ValueError:
            raise HostError(Kind.PROTOCOL, "its clock cannot be read") from None
        start = max(0, int(since + offset)) if since else 0
        done = channel.exchange([f"{start}\n".encode()], lambda _: False)
    if done.stderr.strip() and _NO_UNITS not in done.stderr:
        complaint = printable(done.stderr.strip().splitlines()[-1])[:_LONGEST_ERROR]
        kind = Kind.PRIVILEGE if b"sudo:" in done.stderr else Kind.FAILED
        raise HostError(kind, f"the journal cannot be read: {complaint}")
    found = [parse(line, host, swarm, offset) for line in done.stdout.splitlines()]
    entries = [entry for entry in found if entry is not None and entry.time >= since]
    return HostLog(entries, offset, len(done.stdout) >= MOST_BYTES or len(found) >= lines)


def host_logs(
    swarm: str, targets: list[Target], transport: Transport, *, lines: int, since: float, parallel: int
) -> Iterator[Event[HostLog]]:
    """Reads the journal of every host. Yields events."""

    def work(session: Session, target: Target, note: object) -> HostLog:
        return host_log(session, target.host, swarm, lines, since)

    return parallel_hosts.run(targets, work, transport=transport, parallel=parallel)
