"""``swarmctl watch``: keeps the hosts at the release of the spec."""

from __future__ import annotations

import os
import shlex
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, deploy_steps, rollout_output, selected
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from swarmctl.cli.deploy_rounds import Rounds
    from swarmctl.deploy.outcome import Result
    from swarmctl.diagnostics import Diagnostic
    from swarmctl.spec.load import Document


@with_where("limit", "parallel")
def watch(
    where: Where,
    every: Annotated[
        float,
        typer.Option(
            min=10,
            metavar="SECONDS",
            help="Interval of the looks at all hosts; one that comes back gets it sooner.",
        ),
    ] = 60.0,
    install: Annotated[
        bool,
        typer.Option("--install", help="Write a unit of systemd that does this for your account, and end."),
    ] = False,
) -> None:
    """Keep the hosts at the release of the spec until Ctrl-C: each gets it once it answers.

    The spec is read anew each time; one with errors changes nothing. No robot in use is touched, and what
    somebody deployed after the last edit of the spec stays.
    """
    from swarmctl.cli.deploy_rounds import awaited

    document = console.read_document(where.spec)
    if install:
        _install(where, document.spec.name, every)
        return
    shown: Mapping[str, str] = {}
    rounds = _rounds(where, document)
    try:
        with console.until_ctrl_c():
            while not rounds.stop.requested:
                end = time.monotonic() + every
                found = rounds.again()
                shown = _shown(rounds, found, shown)
                away = awaited(found)
                rounds.remember_awaited(away)
                rounds.await_one(away, end - time.monotonic())
                if not rounds.stop.requested:
                    rounds = _rounds(where, _newest(where, rounds.document))
    finally:
        rounds.remember_awaited({})


def _newest(where: Where, before: Document) -> Document:
    """The spec as it is now, once it has no errors; prints these whenever they change."""
    from swarmctl.linter.runner import check_files

    shown: Sequence[Diagnostic] = ()
    while True:
        document, found = check_files(*where.spec.files, workspaces=where.spec.workspaces)
        if found.diagnostics != shown and (document is None or document.texts != before.texts):
            console.print_diagnostics(found.diagnostics)
        if document is not None:
            return document
        shown = found.diagnostics
        time.sleep(1.0)


def _rounds(where: Where, document: Document) -> Rounds:
    """A deploy of the spec, chosen when the last of its files was edited."""
    from swarmctl.cli.deploy_rounds import Rounds
    from swarmctl.deploy.outcome import WAITS, Rules
    from swarmctl.remote.parallel_hosts import Stop
    from swarmctl.render.build_bundle import bundles

    swarm = where.swarm(document)
    made = bundles(swarm)
    wanted = {name: made[name] for name in selected.hosts(swarm.candidates, where.limit)}
    folder = where.spec.first.parent
    files = [*map(Path, document.texts), *(folder / one for one in document.files.content)]
    rules = Rules(
        optional=[name for name in wanted if swarm.hosts[name].optional],
        apart=WAITS,
        when_seen=True,
        issued=max(one.stat().st_mtime for one in files if one.exists()),
    )
    view = deploy_steps.View("watch", swarm, where, details=False, json=True)
    return Rounds(where, document, view, wanted, rules, [], None, Stop())


def _shown(rounds: Rounds, found: Mapping[str, Result], before: Mapping[str, str]) -> Mapping[str, str]:
    """Prints the results of the hosts that were changed, or fail in another way than before."""
    from swarmctl.remote.transport import HostError

    errors = {host: one.kind.value for host, one in found.items() if isinstance(one, HostError)}
    news = {
        host: one
        for host, one in found.items()
        if (errors[host] != before.get(host) if isinstance(one, HostError) else one.changed)
    }
    if news:
        rollout_output.report(rounds.view.swarm, news, rounds.where.complete)
    return errors


def _install(where: Where, swarm: str, every: float) -> None:
    """Writes the unit, and prints how to start it."""
    from swarmctl.cli import file_writes
    from swarmctl.cli.spec_args import SpecFiles
    from swarmctl.render.quoting import render

    spec = SpecFiles(tuple(one.resolve() for one in where.spec.files), where.spec.workspaces)
    words = shlex.split(Where(spec, limit=where.limit).command("watch", "--every", f"{every:g}"))[1:]
    folder = Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "systemd/user"
    file = folder / f"swarmctl-watch-{swarm}.service"
    folder.mkdir(parents=True, exist_ok=True)
    content = render("watch.service", swarm=swarm, words=[sys.executable, "-m", "swarmctl", *words])
    file_writes.replace(file, content)
    console.show(f"wrote {file}")
    console.show(f"start it: systemctl --user enable --now {file.name}")
    console.show("also while you are not logged in: loginctl enable-linger")
