"""``swarmctl logs``: what the swarm's units have logged, merged over its hosts in the order of time."""

from __future__ import annotations

import dataclasses
import json as json_format
import re
import time
from collections.abc import Iterable
from datetime import datetime
from enum import Enum
from queue import Empty
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, exit_codes, options, selected
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from swarmctl.health.host_logs import Choice, Entry, HostLog, Question
    from swarmctl.remote.transport import HostError, Target

_OFFSET = 0.1  # s from which a clock is worth a note
_FIRST = 3.0  # s within which the last entries of all hosts are waited for, before what comes is shown
_TICK = 0.1  # s


class Level(str, Enum):
    """The lowest level to print."""

    DEBUG = "debug"
    INFO = "info"
    WARN = "warn"
    ERROR = "error"
    FATAL = "fatal"


@with_where("parallel", overlays=options.LongOverlays)
def logs(
    where: Where,
    selection: options.Selection = None,
    follow: Annotated[bool, typer.Option("--follow", "-f", help="Go on until Ctrl-C.")] = False,
    since: Annotated[
        str, typer.Option(metavar="TIME", help='Not before: 10m, 2h, 21:00, "2026-11-26 21:00".')
    ] = "",
    grep: Annotated[str, typer.Option(metavar="REGEX", help="Only messages that match.")] = "",
    level: Annotated[Level, typer.Option(help="Only messages of this level or worse.")] = Level.DEBUG,
    lines: Annotated[
        int, typer.Option("--lines", "-n", min=1, max=10000, metavar="N", help="The last N of each host.")
    ] = 200,
    json: Annotated[
        bool, typer.Option("--json", callback=console.choose_json, help="Print one JSON object a line.")
    ] = False,
) -> None:
    """Show what drivers and programs have logged, of all hosts in the order of time."""
    from swarmctl.health.host_logs import Choice, Question

    start, pattern = start_of(since), _pattern(grep)
    swarm = console.read_spec(where.spec)
    parts = selected.parts(swarm.candidates, selection, "SELECTION")
    targets = where.targets(swarm)
    question = Question(swarm.name, parts, lines, start)
    output = _Output(Choice(level.value, pattern), cut_matters=bool(since), json=json)
    if follow:
        _follow(question, [targets[name] for name in parts], output)
    else:
        _read(question, [targets[name] for name in parts], output, where.parallel)
        if not json and not where.advise_doctor(output.away) and output.has_errors:
            where.advise("status")
    raise typer.Exit(output.exit_code())


def start_of(since: str) -> float:
    """The time that ``--since`` means, in s since 1970, 0 without one; exits if it is none."""
    from swarmctl.health import host_logs

    try:
        return host_logs.since(since, datetime.now().astimezone()) if since else 0.0
    except ValueError:
        console.fail(f"--since {since}: not a time", "such as 10m, 2h or 21:00", code=exit_codes.USAGE)


def _pattern(grep: str) -> re.Pattern[str] | None:
    try:
        return re.compile(grep, re.MULTILINE) if grep else None
    except re.error as error:
        console.fail(f"--grep {grep}: {error}", code=exit_codes.USAGE)


class _Output:
    """Prints entries on stdout, and on stderr what concerns a host."""

    def __init__(self, choice: Choice, *, cut_matters: bool, json: bool) -> None:
        self._choice, self._cut_matters, self._json = choice, cut_matters, json
        self._clocks: set[str] = set()
        self.away: dict[str, HostError] = {}
        self.has_errors = False  # among the entries

    def exit_code(self) -> int:
        """That of the hosts whose last word is an error."""
        if any(error.reached for error in self.away.values()):
            return exit_codes.HOSTS_FAILED
        return exit_codes.HOSTS_UNREACHABLE if self.away else exit_codes.OK

    def is_final(self, hosts: Iterable[str]) -> bool:
        """True once every host has an error that stays."""
        return not any(one not in self.away or self.away[one].retryable for one in hosts)

    def error(self, host: str, error: HostError) -> None:
        """Prints the first error of a host in a row."""
        from swarmctl.views.escape import printable

        if host not in self.away:
            console.show(f"{host}  {error.kind.value}: {printable(error.message)}", error=True)
            if error.hint:
                console.show(f"  help: {printable(error.hint)}", error=True)
        self.away[host] = error

    def host(self, host: str, log: HostLog) -> None:
        """Prints what is worth knowing about the log of a host."""
        if self.away.pop(host, None):
            console.show(f"{host}  connected again", error=True)
        if abs(log.offset) >= _OFFSET and host not in self._clocks:
            self._clocks.add(host)
            console.show(f"note: {host}: its clock is {log.offset:+.1f} s off; corrected", error=True)
        if log.cut and self._cut_matters:
            console.show(f"note: {host}: there is more, only the newest are shown", error=True)

    def entries(self, entries: Iterable[Entry]) -> None:
        """Prints those that were chosen."""
        from swarmctl.views import logs as view

        for entry in entries:
            if entry in self._choice:
                self.has_errors |= entry.level in (Level.ERROR.value, Level.FATAL.value)
                if self._json:
                    print(json_format.dumps(dataclasses.asdict(entry)), flush=True)
                else:
                    console.show(view.lines(entry))


def _read(question: Question, targets: list[Target], output: _Output, parallel: int) -> None:
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.health.host_logs import Merge, host_logs
    from swarmctl.remote.parallel_hosts import Finished
    from swarmctl.remote.transport import HostError

    merge = Merge()
    for event in host_logs(question, targets, transport(), parallel=parallel):
        if not isinstance(event, Finished):
            continue
        result = event.outcome
        if isinstance(result, HostError):
            output.error(event.host, result)
            continue
        output.host(event.host, result)
        for entry in result.entries:
            merge.add(entry, 0.0)
    output.entries(merge.rest())


def _follow(question: Question, targets: list[Target], output: _Output) -> None:
    """Prints what comes, until Ctrl-C, until nobody reads it, or until no host is left."""
    from swarmctl import streams
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.health.host_logs import Merge, followed
    from swarmctl.remote.transport import HostError

    merge, silent = Merge(), {target.host for target in targets}
    first = time.monotonic() + _FIRST
    with console.until_ctrl_c():  # amid a line of many, perhaps: what follows would have a gap before it
        waiting = followed(question, targets, transport())
        while not (streams.has_failed() or output.is_final(question.parts)):
            try:
                host, found = waiting.get(timeout=_TICK)
            except Empty:
                pass
            else:
                silent.discard(host)
                if isinstance(found, HostError):
                    output.error(host, found)
                else:
                    output.host(host, found)
                    for entry in found.entries:
                        merge.add(entry, time.monotonic())
            if not silent or time.monotonic() > first:
                output.entries(merge.due(time.monotonic()))
        output.entries(merge.rest())
