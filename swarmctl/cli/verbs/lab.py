"""``swarmctl lab``: runs the swarm on this machine, with real hosts and emulated robots."""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import (
    complete,
    console,
    exit_codes,
    lab_targets,
    options,
    selected,
    spec_args,
)
from swarmctl.cli.verbs import firmware, lab_fault, lab_scenario
from swarmctl.cli.where import Where

if TYPE_CHECKING:
    from swarmctl.swarm.resolved import Swarm

lab = typer.Typer(
    help="Run the swarm on this machine: real hosts in namespaces, emulated robots.",
    no_args_is_help=True,
    rich_markup_mode=None,
    epilog=exit_codes.epilog(),
)


@lab.command(epilog=exit_codes.epilog())
def up(
    spec: options.Spec,
    overlays: options.Overlays = None,
    name: lab_targets.Name = "",
    workspace: Annotated[
        Path | None,
        typer.Option("--workspace", metavar="DIR", help="A built catkin workspace, installed on every host."),
    ] = None,
    boards: Annotated[
        bool,
        typer.Option(
            "--boards", help="Build the sketches of robots with an Arduino, and run them on simulated boards."
        ),
    ] = False,
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--only",
            metavar="SELECTION",
            autocompletion=complete.selections,
            help="Boot only these hosts, or those of these robots, and the masters they need (repeatable).",
        ),
    ] = None,
) -> None:
    """Boot the hosts of a spec at their addresses, with emulated robots on their lines. Needs root."""
    from swarmctl.lab import lab as labs
    from swarmctl.lab.emulators.emulator_lookup import user_emulators
    from swarmctl.lab.hosts.workspace import installed, workspace_of
    from swarmctl.lab.lab_plan import plan_of
    from swarmctl.lab.part_of_plan import part_of

    swarm = console.read_spec(spec)
    with lab_targets.errors(spec, name):
        own = user_emulators(spec.files[0].resolve().parent / "robots")
        plan = plan_of(swarm, name or None, own, firmware.simulated(swarm) if boards else {})
        if workspace is not None:
            place = swarm.workspace or installed(swarm.distro)
            plan = replace(plan, workspace=workspace_of(workspace, place))
        if only:
            plan = part_of(plan, _with_masters(swarm, selected.hosts(swarm.candidates, only, "--only")))
        labs.up(plan, lambda line: console.show(line, error=True))
    Where(spec, lab=True, lab_name=name, limit=only).advise("deploy")


def _with_masters(swarm: Swarm, hosts: list[str]) -> list[str]:
    """The hosts and those that run their masters; prints a note on each of the latter."""
    from swarmctl.lab.part_of_plan import masters_for
    from swarmctl.yamltext import hostlist

    needed = masters_for(swarm, hosts)
    for hub, members in needed.items():
        listed = hostlist.written(members)
        console.show(f"note: {hub} boots too: it runs the master of {listed}", error=True)
    return [*hosts, *needed]


@lab.command(epilog=exit_codes.epilog())
def down(
    spec: options.AnySpec,
    overlays: options.Overlays = None,
    name: lab_targets.Name = "",
    every: Annotated[bool, typer.Option("--all", help="Remove every lab on this machine.")] = False,
) -> None:
    """Remove a lab: processes, mounts, namespaces and disks."""
    from swarmctl.lab import lab as labs
    from swarmctl.lab import paths

    with lab_targets.errors(spec, name):
        if every:
            names = [place.name for place in paths.all_labs()]
        elif name or (spec := spec or spec_args.usual()):
            names = [lab_targets.name_of(spec, name)]
        else:
            console.fail("the lab is missing", "give its spec, --name or --all")
        for one in names:
            console.err().print(f"lab {one}: {'removed' if labs.down(one) else 'does not exist'}")


@lab.command(epilog=exit_codes.epilog())
def status(
    spec: options.Spec,
    overlays: options.Overlays = None,
    name: lab_targets.Name = "",
    limit: options.Limit = None,
    details: options.Details = False,
    json: options.Json = False,
) -> None:
    """Show the hosts of a lab, their state and their networks."""
    from swarmctl.lab import lab as labs
    from swarmctl.views import lab as view

    with lab_targets.errors(spec, name):
        if limit:
            which, chosen = lab_targets.hosts(spec, name, limit, option="--limit")
            found = labs.status(which)
            found["hosts"] = [host for host in found["hosts"] if host["name"] in chosen]
        else:
            found = labs.status(lab_targets.name_of(spec, name))
    if json:
        console.print_json({"v": 1} | found)
    else:
        console.out().print(view.hosts(found, details=details, width=console.columns()))
        Where(spec, lab=True, lab_name=name).advise("status")


@lab.command(epilog=exit_codes.epilog())
def robots(
    spec: options.Spec,
    overlays: options.Overlays = None,
    name: lab_targets.Name = "",
    limit: Annotated[
        list[str] | None,
        typer.Option(
            "--limit",
            metavar="SELECTION",
            autocompletion=complete.selections,
            help="Only these robots, or those of these hosts: ep-[1-6], @group, type:epuck2 (repeatable).",
        ),
    ] = None,
    details: options.Details = False,
    json: options.Json = False,
) -> None:
    """Show the true poses and wheel speeds of the robots of a lab."""
    from swarmctl.lab import lab as labs
    from swarmctl.views import lab as view

    with lab_targets.errors(spec, name):
        if limit:
            which, known = lab_targets.candidates(spec, name, limit)
            whole = labs.robots(which)
            chosen = lab_targets.there(which, selected.robots(known, limit, "--limit"), list(whole))
            found = {robot: whole[robot] for robot in chosen}
        else:
            found = labs.robots(lab_targets.name_of(spec, name))
    if json:
        console.print_json({"v": 1, "robots": found})
    else:
        console.out().print(view.robots(found, details=details, width=console.columns()))


@lab.command(epilog=exit_codes.epilog(), context_settings={"ignore_unknown_options": True})
def shell(
    spec: options.Spec,
    host: Annotated[
        str,
        typer.Argument(
            help="A host or the one of a robot, or `operator`: this machine, in the lab's network.",
            autocompletion=complete.hosts_and_operator,
        ),
    ],
    command: Annotated[
        list[str] | None, typer.Argument(help="A command instead of a shell, after `--`.")
    ] = None,
    overlays: options.Overlays = None,
    name: lab_targets.Name = "",
) -> None:
    """Open a shell on a host over SSH, or run a command there and exit with its exit code.

    On a host it has the ROS of its swarm (setup.bash), once that is deployed.
    """
    from swarmctl.lab import lab as labs
    from swarmctl.lab import shell as lines
    from swarmctl.lab.hosts import network
    from swarmctl.lab.lab_addresses import OPERATOR

    with lab_targets.errors(spec, name):
        which = lab_targets.name_of(spec, name)
        meeting = labs.operator(which)
        if host == OPERATOR:
            argv = lines.operator_argv(command or (), os.environ.get("SHELL", "/bin/sh"))
        else:
            host = selected.one(lab_targets.candidates(spec, name, [host])[1], host, "hosts", "HOST")
            line = lines.host_line(lines.setup_file(meeting.swarm), command or ())
            argv = labs.ssh_argv(which, host, (line,), terminal=_at_terminal())
        network.enter(meeting.namespace)
    try:
        os.execvp(argv[0], argv)
    except OSError as error:
        console.fail(f"cannot run {argv[0]}: {error.strerror}")


def _at_terminal() -> bool:
    return sys.stdin.isatty() and sys.stdout.isatty()


lab.add_typer(lab_fault.fault, name="fault")
lab.command(epilog=exit_codes.epilog())(lab_fault.repair)
lab.command(epilog=exit_codes.epilog(exit_codes.UNHEALTHY))(lab_scenario.scenario)
