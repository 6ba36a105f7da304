"""Output of the verbs that change hosts: events as they happen, a report per host, the exit code."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from swarmctl.cli import console, exit_codes

if TYPE_CHECKING:
    from swarmctl.deploy.rollout import Outcome, Removed, Result
    from swarmctl.remote.parallel_hosts import Event
    from swarmctl.swarm.resolved import Host

    Events = Iterator[Event[Outcome]] | Iterator[Event[Removed]]


def results(events: Events, hosts: list[str], *, quiet: bool) -> Mapping[str, Result]:
    """The result of every host, in the order of ``hosts``, shown on the way unless ``quiet``."""
    from swarmctl.remote.parallel_hosts import Finished, Skipped, result_of

    shown = events if quiet else _shown(events, hosts)
    found = {event.host: result_of(event) for event in shown if isinstance(event, Finished | Skipped)}
    return {name: found[name] for name in hosts}


def note(text: str) -> None:
    """Print a note about progress on stderr."""
    console.err().print(text)


def report(found: Mapping[str, Result], absent: Sequence[str] = ()) -> None:
    """Print a line per host, how to fix failures, and a summary. ``absent``: unreachable optional hosts."""
    from rich.text import Text

    from swarmctl.deploy.rollout import Outcome
    from swarmctl.remote.transport import HostError
    from swarmctl.views import progress
    from swarmctl.views.escape import printable

    for name, result in found.items():
        console.out().print(Text.assemble((name, "bold"), "  ", progress.verdict(result)))
        if isinstance(result, HostError) and result.hint:
            console.out().print(Text.assemble(("  help", "bold green"), f": {printable(result.hint)}"))
        for remark in result.plan.notes if isinstance(result, Outcome) else ():
            console.out().print(Text(f"  note: {printable(remark)}", "dim"))
    errors = {name: result for name, result in found.items() if isinstance(result, HostError)}
    failed = {name: error for name, error in errors.items() if name not in absent}
    changed = sum(not isinstance(result, HostError) and result.changed for result in found.values())
    text = f"{changed} of {len(found)} hosts changed"
    if absent:
        text += f"; optional and unreachable: {', '.join(absent)}"
    if failed:
        text += f"; failed: {', '.join(failed)}"
    if any(error.retryable for error in failed.values()):
        text += "; run the same command again when these hosts are reachable"
    console.out().print(text)


@contextmanager
def journal_warnings() -> Iterator[None]:
    """Turn a failure to write the journal into a warning: only ``plan --offline`` reads it."""
    try:
        yield
    except OSError as error:
        console.err().print(f"warning: {error.filename} cannot be written ({error.strerror}); "
                            "`plan --offline` will not include this run")  # fmt: skip


def warn_of_removed_hosts(hosts: Sequence[str]) -> None:
    """Warn about hosts that are no longer in the spec but still run its release."""
    for name in hosts:
        console.err().print(
            f"warning: host {name} is no longer in the spec but still runs the release deployed to it; "
            f"add it again and run `swarmctl remove SPEC --limit {name}`, then delete it"
        )


def document(swarm: str, found: Mapping[str, Result]) -> dict[str, Any]:
    """The report as JSON data."""
    return {
        "v": 1,
        "swarm": swarm,
        "hosts": [{"host": name} | _entry(result) for name, result in found.items()],
    }


def absent(found: Mapping[str, Result], hosts: Mapping[str, Host]) -> tuple[str, ...]:
    """The optional hosts that could not be reached; they do not count as failures."""
    from swarmctl.remote.transport import HostError

    return tuple(
        name
        for name, result in found.items()
        if hosts[name].optional and isinstance(result, HostError) and not result.reached
    )


def exit_code(found: Mapping[str, Result], *, interrupted: bool, absent: Sequence[str] = ()) -> int:
    """The exit code of a rollout; hosts in ``absent`` do not count."""
    from swarmctl.remote.transport import HostError

    errors = [
        result for name, result in found.items() if isinstance(result, HostError) and name not in absent
    ]
    if interrupted:
        return exit_codes.INTERRUPTED
    if any(error.reached for error in errors):
        return exit_codes.HOSTS_FAILED
    return exit_codes.HOSTS_UNREACHABLE if errors else exit_codes.OK


def _entry(result: Result) -> dict[str, Any]:
    from swarmctl.deploy.rollout import Outcome
    from swarmctl.remote.transport import HostError

    if isinstance(result, HostError):
        return {"error": {"kind": result.kind.value, "message": result.message, "hint": result.hint}}
    if isinstance(result, Outcome):
        return {"changed": result.changed, "plan": result.plan.to_json(), "units": dict(result.units)}
    return {"changed": result.changed}


def _shown(events: Events, hosts: list[str]) -> Iterable[Any]:
    """Yield the events and show them: a live table on a terminal, line by line elsewhere."""
    from swarmctl.views import progress

    if console.err().is_terminal:
        from rich.live import Live

        board = progress.Board(hosts)
        with Live(board, console=console.err(), refresh_per_second=10, transient=True):
            for event in events:
                board.take(event)
                yield event
    else:
        for event in events:
            if (line := progress.line(event)) is not None:
                console.err().print(line)
            yield event
