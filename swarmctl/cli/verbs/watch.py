"""``swarmctl watch``: keeps the hosts at the release of the spec."""

from __future__ import annotations

import os
import shlex
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, deploy_steps, exit_codes, rollout_output, selected
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from swarmctl.cli.deploy_rounds import Rounds
    from swarmctl.deploy.outcome import Result
    from swarmctl.diagnostics import Diagnostic
    from swarmctl.spec.load import Document

_PAUSE = 5.0  # s at least between two rounds


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
    from swarmctl.cli.deploy_rounds import awaited, news

    document = console.read_document(where.spec)
    if install:
        if where.in_lab:
            console.fail("--install is for real hosts", "leave --lab out", code=exit_codes.USAGE)
        _install(where, document.spec.name, every)
        return
    found: Mapping[str, Result] = {}
    rounds = _rounds(where, document, _edited(document, where))
    try:
        with console.until_ctrl_c():
            while not rounds.stop.requested:
                end = time.monotonic() + every
                before, found = found, _again(rounds, found)
                if new := {host: one for host, one in news(found, before).items() if _matters(one)}:
                    rollout_output.report(rounds.view.swarm, new, where.complete)
                away = awaited(found)
                rounds.remember_awaited(away)
                rounds.await_one(away, max(_PAUSE, end - time.monotonic()))
                if not rounds.stop.requested:
                    rounds = _next(where, rounds)
    finally:
        rounds.remember_awaited({})


def _again(rounds: Rounds, before: Mapping[str, Result]) -> Mapping[str, Result]:
    """The results of a round; those of ``before`` if it could not begin, as is printed then."""
    try:
        return rounds.again()
    except typer.Exit:
        return before


def _matters(one: Result) -> bool:
    """Returns False for a host that has the release already."""
    from swarmctl.remote.transport import HostError

    return isinstance(one, HostError) or one.changed


def _next(where: Where, before: Rounds) -> Rounds:
    """The next round, of the spec as it is then."""
    while True:
        try:
            made = _rounds(where, _newest(where, before.document), before.rules.issued)
        except (typer.Exit, OSError):  # what is printed already, or a file that has just gone
            time.sleep(_PAUSE)
            continue
        if {name: one.digest for name, one in made.wanted.items()} != {
            name: one.digest for name, one in before.wanted.items()
        }:
            made = replace(made, rules=replace(made.rules, issued=time.time()))
        return replace(made, stop=before.stop, failed=before.failed)


def _newest(where: Where, before: Document) -> Document:
    """The spec as it is now, once it has no errors and is no longer edited; prints these when they change."""
    from swarmctl.linter.runner import check_files

    shown: Sequence[Diagnostic] = ()
    last = before
    while True:
        document, found = check_files(*where.spec.files, workspaces=where.spec.workspaces)
        if document is not None and document.texts == last.texts:
            return document
        if found.diagnostics != shown:
            console.print_diagnostics(found.diagnostics)
        shown, last = found.diagnostics, document or last
        time.sleep(1.0)


def _edited(document: Document, where: Where) -> float:
    """When a file of the spec was edited last, s since 1970."""
    folder = where.spec.first.parent
    files = [*map(Path, document.texts), *(folder / one for one in document.files.content)]
    return min(time.time(), max((one.stat().st_mtime for one in files if one.exists()), default=0.0))


def _rounds(where: Where, document: Document, issued: float) -> Rounds:
    """A deploy of the spec."""
    from swarmctl.cli.deploy_rounds import Rounds
    from swarmctl.deploy.outcome import WAITS, Rules
    from swarmctl.remote.parallel_hosts import Stop
    from swarmctl.render.build_bundle import bundles

    swarm = where.swarm(document)
    made = bundles(swarm)
    wanted = {name: made[name] for name in selected.hosts(swarm.candidates, where.limit)}
    optional = [name for name in wanted if swarm.hosts[name].optional]
    rules = Rules(optional=optional, apart=WAITS, when_seen=True, issued=issued)
    view = deploy_steps.View("watch", swarm, where, details=False, json=True)
    return Rounds(where, document, view, wanted, rules, [], None, Stop())


def _install(where: Where, swarm: str, every: float) -> None:
    """Writes the unit, and prints how to start it."""
    from swarmctl.cli import file_writes
    from swarmctl.cli.spec_args import SpecFiles
    from swarmctl.render.quoting import render

    spec = SpecFiles(tuple(one.resolve() for one in where.spec.files), where.spec.workspaces)
    words = shlex.split(Where(spec, limit=where.limit).command("watch", "--every", f"{every:g}"))[1:]
    folder = Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "systemd/user"
    file = folder / f"swarmctl-watch-{swarm}.service"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        console.fail(console.cannot_write(error, str(folder)))
    content = render("watch.service", swarm=swarm, words=[sys.executable, "-m", "swarmctl", *words])
    file_writes.replace(file, content)
    console.show(f"wrote {file}")
    console.show(f"start it: systemctl --user enable --now {file.name}")
    console.show("also while you are not logged in: loginctl enable-linger")
