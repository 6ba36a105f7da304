"""``swarmctl doctor``: what on this machine and on the way to a host is wrong, in the order of first aid."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import complete, console, exit_codes, options, selected, stop_targets
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from swarmctl.health.first_aid import Step
    from swarmctl.remote.transport import Target, Transport


@with_where()
def doctor(
    where: Where,
    host: Annotated[
        str | None,
        typer.Argument(
            help="A host, or the one of a robot; without it, the first that cannot be logged in to.",
            autocompletion=complete.hosts_and_robots,
        ),
    ] = None,
    json: options.Json = False,
) -> None:
    """Find what keeps this machine from a host, one check after the other, each with its remedy."""
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.cli.this_machine import steps
    from swarmctl.health.first_aid import examine, host_steps
    from swarmctl.health.verdict import State
    from swarmctl.remote.first_contact import FirstContact
    from swarmctl.views.doctor import lines

    reach = stop_targets.read(where.spec)
    name = selected.one(reach.candidates, host, "hosts", "HOST") if host else ""
    if name and name not in reach.hosts:
        console.fail(f"the spec has no address for {name}")
    targets = where.targets(reach)
    ssh = transport()
    complete_hint = where.complete
    found: list[dict[str, str]] = []

    def make(about: str, todo: Iterable[Step]) -> None:
        if not json:
            console.show(about or "this machine")
        for check in examine(todo):
            hint = complete_hint(check.verdict.hint)
            if not json:
                console.show(lines(replace(check, verdict=replace(check.verdict, hint=hint))))
            state, message = check.verdict.state.value, check.verdict.message
            found.append(
                {"host": about, "check": check.name, "state": state, "message": message, "hint": hint}
            )

    make("", steps(where.spec, [targets[name]] if name else list(targets.values())))
    name = name or _first_away(targets, ssh, silent=json)
    if name:
        make(name, host_steps(targets[name], FirstContact(ssh)))
    sick = any(one["state"] == State.BAD.value for one in found)
    if json:
        console.print_json({"v": 1, "swarm": reach.name, "checks": found})
    elif not sick:
        where.advise("status", *(["--limit", name] if name else []))
    raise typer.Exit(exit_codes.UNHEALTHY if sick else exit_codes.OK)


def _first_away(targets: Mapping[str, Target], ssh: Transport, *, silent: bool) -> str:
    """The first host of the spec that cannot be logged in to; empty if all can."""
    from swarmctl.remote import parallel_hosts
    from swarmctl.remote.parallel_hosts import Finished
    from swarmctl.remote.transport import HostError

    events = parallel_hosts.run(targets.values(), lambda *_: None, transport=ssh, parallel=options.PARALLEL)
    away = {one.host for one in events if isinstance(one, Finished) and isinstance(one.outcome, HostError)}
    if not silent:
        console.show(f"hosts: {len(targets) - len(away)} of {len(targets)} can be logged in to")
    return next((name for name in targets if name in away), "")
