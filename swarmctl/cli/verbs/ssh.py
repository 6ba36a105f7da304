"""``swarmctl ssh``: a shell on one host by the program ``ssh``, which takes the place of swarmctl."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import complete, console, next_command, selected, stop_targets
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from swarmctl.cli.spec_args import SpecFiles
    from swarmctl.spec.reach import Reach


@with_where()
def ssh(
    where: Where,
    host: Annotated[
        str,
        typer.Argument(help="A host, or the one of a robot.", autocompletion=complete.hosts_and_robots),
    ],
    command: Annotated[
        list[str] | None, typer.Argument(help="A command instead of a shell, after `--`.")
    ] = None,
) -> None:
    """Open a shell on a host, or run a command there at this terminal. Exits with the exit code of `ssh`.

    Address, account, keys and jump host are those of the spec; all else is as ~/.ssh/config has it.
    """
    from swarmctl.remote.host_commands import shell_command

    reach = stop_targets.read(where.spec)
    name = selected.one(reach.candidates, host, "hosts", "HOST")
    if name not in reach.hosts:
        console.fail(f"the spec has no address for {name}")
    line = shell_command(command) if command else ""
    terminal = sys.stdin.isatty() and sys.stdout.isatty()
    if where.in_lab:
        where.targets(reach)  # enters its network
        argv = _in_lab(where.spec, where.lab_of(reach.name), name, line, terminal=terminal)
    else:
        argv = _to_host(where.spec, reach, name, line, terminal=terminal)
    try:
        os.execvp(argv[0], argv)
    except OSError as error:
        console.fail(f"cannot run {argv[0]}: {error.strerror}", "install it: `apt install openssh-client`")


def _in_lab(spec: SpecFiles, lab_name: str, host: str, line: str, *, terminal: bool) -> tuple[str, ...]:
    from swarmctl.cli import lab_selection
    from swarmctl.lab import lab as labs

    with lab_selection.errors(spec, lab_name):
        lab_selection.there(lab_name, [host], [one.name for one in labs.plan(lab_name).hosts])
        return labs.ssh_argv(lab_name, host, (line,) if line else (), terminal=terminal)


def _to_host(spec: SpecFiles, reach: Reach, name: str, line: str, *, terminal: bool) -> tuple[str, ...]:
    from swarmctl.cli import ssh_targets
    from swarmctl.remote.known_hosts import path_beside
    from swarmctl.remote.openssh_options import interactive
    from swarmctl.remote.ssh_limits import Timeouts
    from swarmctl.remote.transport import HostError

    known = ssh_targets.read_known_hosts(spec.first)
    target = ssh_targets.resolved(reach, known)[0][name]
    for one in target.way():
        if set(one.keys) & set(one.revoked):
            console.fail(f"a pinned key of {one.host} ({one.address}) is revoked")
        if not one.keys:
            trust = next_command.completing(spec, [])("`swarmctl trust SPEC`")
            console.fail(
                f"{one.host} ({one.address}) has no pinned key",
                f"{trust} shows the keys of new hosts and pins them",
            )
    limits = Timeouts()
    try:
        return interactive(
            target, path_beside(spec.first).absolute(),
            lambda one: known.alias(one.host, one.address, one.port), line,
            terminal=terminal, connect=limits.connect, acknowledgement=limits.acknowledgement,
        )  # fmt: skip
    except HostError as error:
        console.fail(error.message, error.hint)
