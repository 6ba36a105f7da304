"""What verbs that change hosts share: events shown as they come, a report of every host, the exit code."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from swarmctl.cli import console, exits

if TYPE_CHECKING:
    from swarmctl.deploy.rollout import Outcome, Removed, Result
    from swarmctl.remote.fleet import Event
    from swarmctl.topology.swarm import Host

    Events = Iterator[Event[Outcome]] | Iterator[Event[Removed]]


def results(events: Events, hosts: list[str], *, quiet: bool) -> Mapping[str, Result]:
    """The result of every host, in the order of ``hosts``, shown on the way unless ``quiet``."""
    from swarmctl.remote.fleet import Finished, Skipped, result_of

    shown = events if quiet else _shown(events, hosts)
    found = {event.host: result_of(event) for event in shown if isinstance(event, Finished | Skipped)}
    return {name: found[name] for name in hosts}


def say(text: str) -> None:
    """Tell on stderr what happens next."""
    console.err().print(text)


def report(found: Mapping[str, Result], absent: Sequence[str] = ()) -> None:
    """One line a host, the way to mend what failed, and a sum. ``absent``: optional hosts that are away."""
    from rich.text import Text

    from swarmctl.deploy.rollout import Outcome
    from swarmctl.remote.transport import HostError
    from swarmctl.views import progress
    from swarmctl.views.text import printable

    for name, result in found.items():
        console.out().print(Text.assemble((name, "bold"), "  ", progress.verdict(result)))
        if isinstance(result, HostError) and result.hint:
            console.out().print(Text.assemble(("  help", "bold green"), f": {printable(result.hint)}"))
        for note in result.plan.notes if isinstance(result, Outcome) else ():
            console.out().print(Text(f"  note: {printable(note)}", "dim"))
    errors = {name: result for name, result in found.items() if isinstance(result, HostError)}
    failed = {name: error for name, error in errors.items() if name not in absent}
    changed = sum(not isinstance(result, HostError) and result.changed for result in found.values())
    said = f"{changed} of {len(found)} hosts changed"
    if absent:
        said += f"; away, and optional: {', '.join(absent)}"
    if failed:
        said += f"; not done: {', '.join(failed)}"
    if any(error.retryable for error in failed.values()):
        said += "; run the same command again when they can be reached"
    console.out().print(said)


@contextmanager
def journal_warnings() -> Iterator[None]:
    """A journal that cannot be kept spoils no deploy; only plans made offline will not know of it."""
    try:
        yield
    except OSError as error:
        console.err().print(f"warning: {error.filename} cannot be written ({error.strerror}); "
                            "`plan --offline` will not know of this run")  # fmt: skip


def tell_of_left(hosts: Sequence[str]) -> None:
    """Hosts that the spec has dropped while they still run what it gave them."""
    for name in hosts:
        console.err().print(
            f"warning: host {name} left the spec, and still runs what was deployed to it; "
            f"put it back, and take the swarm off it: `swarmctl remove SPEC --limit {name}`"
        )


def document(swarm: str, found: Mapping[str, Result]) -> dict[str, Any]:
    """The same as JSON."""
    return {
        "v": 1,
        "swarm": swarm,
        "hosts": [{"host": name} | _entry(result) for name, result in found.items()],
    }


def absent(found: Mapping[str, Result], hosts: Mapping[str, Host]) -> tuple[str, ...]:
    """The optional hosts that could not be reached: the swarm is complete without them."""
    from swarmctl.remote.transport import HostError

    return tuple(
        name
        for name, result in found.items()
        if hosts[name].optional and isinstance(result, HostError) and not result.reached
    )


def exit_code(found: Mapping[str, Result], *, interrupted: bool, absent: Sequence[str] = ()) -> int:
    from swarmctl.remote.transport import HostError

    errors = [
        result for name, result in found.items() if isinstance(result, HostError) and name not in absent
    ]
    if interrupted:
        return exits.INTERRUPTED
    if any(error.reached for error in errors):
        return exits.HOSTS_FAILED
    return exits.HOSTS_UNREACHABLE if errors else exits.OK


def _entry(result: Result) -> dict[str, Any]:
    from swarmctl.deploy.rollout import Outcome
    from swarmctl.remote.transport import HostError

    if isinstance(result, HostError):
        return {"error": {"kind": result.kind.value, "message": result.message, "hint": result.hint}}
    if isinstance(result, Outcome):
        return {"changed": result.changed, "plan": result.plan.to_json(), "units": dict(result.units)}
    return {"changed": result.changed}


def _shown(events: Events, hosts: list[str]) -> Iterable[Any]:
    """Pass the events on: over a board on a terminal, line by line elsewhere."""
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
