"""Output of the verbs that change hosts: events as they happen, a report per host, the exit code."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from swarmctl.cli import console, exit_codes

if TYPE_CHECKING:
    from swarmctl.cli.where import Where
    from swarmctl.deploy.host_lists import LeftHost
    from swarmctl.deploy.outcome import Outcome, Removed, Result
    from swarmctl.deploy.prepare import Prepared
    from swarmctl.remote.parallel_hosts import Event
    from swarmctl.swarm.resolved import Host, Swarm

    Events = Iterator[Event[Outcome]] | Iterator[Event[Removed]] | Iterator[Event[Prepared]]


def results(events: Events, hosts: list[str], *, quiet: bool) -> Mapping[str, Result]:
    """The result of every host, in the order of ``hosts``, shown on the way unless ``quiet``."""
    from swarmctl.remote.parallel_hosts import Finished

    shown = events if quiet else _shown(events, hosts)
    found = {event.host: event.outcome for event in shown if isinstance(event, Finished)}
    return {name: found[name] for name in hosts}


def follow(events: Iterator[Event[object]], hosts: list[str], *, quiet: bool) -> None:
    """Waits for the end of ``events``, shown on the way unless ``quiet``; results are shown later."""
    from swarmctl.remote.parallel_hosts import Finished

    unfinished = (event for event in events if not isinstance(event, Finished))
    for _ in unfinished if quiet else _shown(unfinished, hosts):
        pass


def note(text: str) -> None:
    """Print a note about progress on stderr."""
    console.show(text, error=True)


def report(
    swarm: Swarm,
    found: Mapping[str, Result],
    complete: Callable[[str], str],
    absent: Sequence[str] = (),
    *,
    details: bool = False,
    interrupted: bool = False,
) -> None:
    """Print the results of the hosts and a summary. ``absent``: unreachable optional hosts.

    ``complete`` writes the commands in hints as they can be typed.
    """
    from swarmctl.views.equal_hosts import names_of
    from swarmctl.views.rollout import RolloutView

    view = RolloutView(names_of(swarm), details, console.columns(), complete)
    console.out().print(view.text(found, absent))
    if interrupted:
        console.err().print("interrupted")


@contextmanager
def journal_warnings() -> Iterator[None]:
    """Turn a failure to write the journal into a warning: only ``plan --offline`` reads it."""
    try:
        yield
    except OSError as error:
        console.err().print(f"warning: {console.cannot_write(error, 'the journal of this swarm')}; "
                            "`plan --offline` will not include this run")  # fmt: skip


def warn_of_left_hosts(found: tuple[Mapping[str, LeftHost], Sequence[str]], where: Where) -> None:
    """Warn about hosts that are no longer in the spec but may still run its release.

    ``found``: those whose address is known, and the names of the others.
    """
    left, unknown = found
    command = where.limited().command("remove", "--orphans")
    for name in [*left, *unknown]:
        one = left.get(name)
        named = f" ({one.place}, in the list of {one.named_by})" if one and one.named_by else ""
        console.err().print(
            f"warning: host {name}{named} is no longer in the spec but may still run the release deployed to "
            f"it; `{command}` removes it from there"
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
        if name in hosts and hosts[name].optional and isinstance(result, HostError) and not result.reached
    )


def unfit(found: Mapping[str, Result], hint: str = "") -> str:
    """The hosts that lack what their part of the swarm needs, as a list; empty if none does.

    ``hint``: only those whose hint begins with it.
    """
    from swarmctl.remote.transport import HostError, Kind
    from swarmctl.yamltext import hostlist

    errors = ((name, one) for name, one in found.items() if isinstance(one, HostError))
    lacking = [name for name, one in errors if one.kind is Kind.UNFIT and one.hint.startswith(hint)]
    return hostlist.written(lacking)


def held(found: Mapping[str, Result]) -> bool:
    """Returns True if a host was held back because of others."""
    from swarmctl.remote.transport import HostError, Kind

    return any(isinstance(one, HostError) and one.kind is Kind.HELD for one in found.values())


def errors(found: Mapping[str, Result]) -> list[str]:
    """The kinds of the errors of hosts."""
    from swarmctl.remote.transport import HostError

    return [result.kind.value for result in found.values() if isinstance(result, HostError)]


def advise_again(verb: str, where: Where, found: Mapping[str, Result], absent: Sequence[str] = ()) -> None:
    """After failures: pin new keys, or run ``verb`` again on the hosts that were out of reach."""
    from swarmctl.cli import next_command
    from swarmctl.remote.transport import HostError, Kind

    failed = {name: one for name, one in found.items() if isinstance(one, HostError) and name not in absent}
    keys = [name for name, error in failed.items() if error.kind is Kind.HOST_KEY]
    again = [name for name, error in failed.items() if error.retryable]
    if keys and not where.in_lab:
        where.limited(next_command.selection(keys)).advise("trust")
    elif again:
        where.limited(next_command.selection(again)).advise(verb)


def exit_code(found: Mapping[str, Result], *, interrupted: bool, absent: Sequence[str] = ()) -> int:
    """The exit code of a rollout; hosts in ``absent`` do not count."""
    from swarmctl.deploy.outcome import Outcome
    from swarmctl.remote.transport import HostError

    errors = [
        result for name, result in found.items() if isinstance(result, HostError) and name not in absent
    ]
    if interrupted:
        return exit_codes.INTERRUPTED
    if any(error.reached for error in errors):
        return exit_codes.HOSTS_FAILED
    if errors:
        return exit_codes.HOSTS_UNREACHABLE
    failing = any(isinstance(one, Outcome) and one.errors for one in found.values())
    return exit_codes.UNHEALTHY if failing else exit_codes.OK


def _entry(result: Result) -> dict[str, Any]:
    from swarmctl.deploy.outcome import Outcome
    from swarmctl.deploy.prepare import Prepared
    from swarmctl.remote.transport import HostError

    if isinstance(result, HostError):
        return {"error": result.to_json()}
    if isinstance(result, Outcome):
        return {"changed": result.changed, "plan": result.plan.to_json(), "units": dict(result.units)}
    steps = {"steps": [step.to_json() for step in result.steps]} if isinstance(result, Prepared) else {}
    return {"changed": result.changed, **steps}


def _shown(events: Iterable[Any], hosts: list[str]) -> Iterable[Any]:
    """Yield the events and show them: a live table on a terminal with a cursor, line by line elsewhere."""
    from swarmctl.views import progress

    if console.err().is_terminal and not console.err().is_dumb_terminal:
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
