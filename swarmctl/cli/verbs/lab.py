"""``swarmctl lab``: runs the swarm on this machine, with real hosts and emulated robots."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import complete, console, exit_codes, next_command, options, selected, spec_args
from swarmctl.cli.spec_args import SpecFiles
from swarmctl.cli.verbs import firmware

if TYPE_CHECKING:
    from swarmctl.spec.selection_candidates import Candidates
    from swarmctl.swarm.resolved import Swarm

lab = typer.Typer(
    help="Run the swarm on this machine: real hosts in namespaces, emulated robots.",
    no_args_is_help=True,
    rich_markup_mode=None,
    epilog=exit_codes.epilog(),
)

Name = Annotated[
    str, typer.Option("--name", metavar="NAME", help="The name of the lab; by default that of the swarm.")
]
Hosts = Annotated[
    list[str],
    typer.Argument(
        metavar="HOST", help="Hosts, or those of robots: pi-*, @group, !k3.", autocompletion=complete.hosts
    ),
]
Network = Annotated[
    str,
    typer.Option("--network", metavar="NAME", help="Only this network; by default all networks of the host."),
]
Robots = Annotated[
    list[str],
    typer.Argument(
        metavar="ROBOT", help="Robots: k3, ep-[1-6], type:epuck2, @group.", autocompletion=complete.robots
    ),
]


@contextmanager
def _lab_errors(spec: SpecFiles | None, name: str) -> Iterator[None]:
    """Exit with message and help for an error of the lab of ``spec``, or of the one called ``name``."""
    from swarmctl.lab.errors import LabError

    try:
        yield
    except LabError as error:
        lines = next_command.in_lab_errors(error.help_lines, spec, name) if spec else error.help_lines
        console.fail(str(error), *lines)


def _name(spec: SpecFiles | None, name: str) -> str:
    """The name of the lab; the spec is read only without a given name, but it must be there."""
    return name if spec is None or (name and spec.first.exists()) else console.read_spec(spec).name


@lab.command(epilog=exit_codes.epilog())
def up(
    spec: options.Spec,
    overlays: options.Overlays = None,
    name: Name = "",
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
    with _lab_errors(spec, name):
        own = user_emulators(spec.files[0].resolve().parent / "robots")
        plan = plan_of(swarm, name or None, own, firmware.simulated(swarm) if boards else {})
        if workspace is not None:
            place = swarm.workspace or installed(swarm.distro)
            plan = replace(plan, workspace=workspace_of(workspace, place))
        if only:
            plan = part_of(plan, _with_masters(swarm, selected.hosts(swarm.candidates, only, "--only")))
        labs.up(plan, lambda line: console.show(line, error=True))
    next_command.advise("deploy", spec, *next_command.where(lab=True, lab_name=name, limit=only))


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
    name: Name = "",
    every: Annotated[bool, typer.Option("--all", help="Remove every lab on this machine.")] = False,
) -> None:
    """Remove a lab: processes, mounts, namespaces and disks."""
    from swarmctl.lab import lab as labs
    from swarmctl.lab import paths

    with _lab_errors(spec, name):
        if every:
            names = [place.name for place in paths.all_labs()]
        elif name or (spec := spec or spec_args.usual()):
            names = [_name(spec, name)]
        else:
            console.fail("the lab is missing", "give its spec, --name or --all")
        for one in names:
            console.err().print(f"lab {one}: {'removed' if labs.down(one) else 'does not exist'}")


@lab.command(epilog=exit_codes.epilog())
def status(
    spec: options.Spec,
    overlays: options.Overlays = None,
    name: Name = "",
    limit: options.Limit = None,
    details: options.Details = False,
    json: options.Json = False,
) -> None:
    """Show the hosts of a lab, their state and their networks."""
    from swarmctl.lab import lab as labs
    from swarmctl.views import lab as view

    with _lab_errors(spec, name):
        if limit:
            which, chosen = _chosen_hosts(spec, name, limit, option="--limit")
            found = labs.status(which)
            found["hosts"] = [host for host in found["hosts"] if host["name"] in chosen]
        else:
            found = labs.status(_name(spec, name))
    if json:
        console.print_json({"v": 1} | found)
    else:
        console.out().print(view.hosts(found, details=details, width=console.columns()))
        next_command.advise("status", spec, *next_command.where(lab=True, lab_name=name))


@lab.command(epilog=exit_codes.epilog())
def robots(
    spec: options.Spec,
    overlays: options.Overlays = None,
    name: Name = "",
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

    with _lab_errors(spec, name):
        if limit:
            which, known = _candidates(spec, name, limit)
            whole = labs.robots(which)
            chosen = _there(which, selected.robots(known, limit, "--limit"), list(whole))
            found = {robot: whole[robot] for robot in chosen}
        else:
            found = labs.robots(_name(spec, name))
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
    name: Name = "",
) -> None:
    """Open a shell on a host over SSH, or run a command there and exit with its exit code.

    On a host it has the ROS of its swarm (setup.bash), once that is deployed.
    """
    from swarmctl.lab import lab as labs
    from swarmctl.lab import shell as lines
    from swarmctl.lab.hosts import network
    from swarmctl.lab.lab_addresses import OPERATOR

    with _lab_errors(spec, name):
        which = _name(spec, name)
        meeting = labs.operator(which)
        if host == OPERATOR:
            argv = lines.operator_argv(command or (), os.environ.get("SHELL", "/bin/sh"))
        else:
            host = selected.one(_candidates(spec, name, [host])[1], host, "hosts", "HOST")
            line = lines.host_line(lines.setup_file(meeting.swarm), command or ())
            argv = labs.ssh_argv(which, host, (line,), terminal=_at_terminal())
        network.enter(meeting.namespace)
    try:
        os.execvp(argv[0], argv)
    except OSError as error:
        console.fail(f"cannot run {argv[0]}: {error.strerror}")


def _at_terminal() -> bool:
    return sys.stdin.isatty() and sys.stdout.isatty()


@lab.command(epilog=exit_codes.epilog())
def unplug(spec: options.Spec, robots: Robots, overlays: options.Overlays = None, name: Name = "") -> None:
    """Disconnect the cables of robots. The robots keep executing their last commands."""
    from swarmctl.lab import lab as labs

    with _lab_errors(spec, name):
        which, chosen = _chosen_robots(spec, name, robots)
        for robot in chosen:
            labs.unplug(which, robot)
    _done(spec, name, "cable disconnected", chosen)


@lab.command(epilog=exit_codes.epilog())
def plug(spec: options.Spec, robots: Robots, overlays: options.Overlays = None, name: Name = "") -> None:
    """Reconnect the cables of robots."""
    from swarmctl.lab import lab as labs

    with _lab_errors(spec, name):
        which, chosen = _chosen_robots(spec, name, robots)
        for robot in chosen:
            labs.plug(which, robot)
    _done(spec, name, "cable connected", chosen)


@lab.command(epilog=exit_codes.epilog())
def cut(
    spec: options.Spec,
    hosts: Hosts,
    overlays: options.Overlays = None,
    name: Name = "",
    network: Network = "",
) -> None:
    """Disconnect hosts from their networks."""
    from swarmctl.lab import lab as labs

    with _lab_errors(spec, name):
        which, chosen = _chosen_hosts(spec, name, hosts, network)
        off = {one for host in chosen for one in labs.cut(which, host, network or None)}
    _done(spec, name, f"disconnected from {', '.join(sorted(off))}", chosen)


@lab.command(epilog=exit_codes.epilog())
def join(
    spec: options.Spec,
    hosts: Hosts,
    overlays: options.Overlays = None,
    name: Name = "",
    network: Network = "",
) -> None:
    """Reconnect hosts to their networks."""
    from swarmctl.lab import lab as labs

    with _lab_errors(spec, name):
        which, chosen = _chosen_hosts(spec, name, hosts, network)
        on = {one for host in chosen for one in labs.join(which, host, network or None)}
    _done(spec, name, f"connected to {', '.join(sorted(on))}", chosen)


@lab.command(epilog=exit_codes.epilog())
def kill(spec: options.Spec, hosts: Hosts, overlays: options.Overlays = None, name: Name = "") -> None:
    """Cut the power of hosts; their disks stay."""
    from swarmctl.lab import lab as labs

    with _lab_errors(spec, name):
        which, chosen = _chosen_hosts(spec, name, hosts)
        for host in chosen:
            labs.kill(which, host)
    _done(spec, name, "power off", chosen)


@lab.command(epilog=exit_codes.epilog())
def start(spec: options.Spec, hosts: Hosts, overlays: options.Overlays = None, name: Name = "") -> None:
    """Switch hosts on again, and wait until they answer SSH."""
    from swarmctl.lab import lab as labs

    with _lab_errors(spec, name):
        which, chosen = _chosen_hosts(spec, name, hosts)
        labs.start(which, chosen, lambda line: console.show(line, error=True))
    _done(spec, name, "power on", chosen)


def _candidates(spec: SpecFiles, name: str, selections: Sequence[str]) -> tuple[str, Candidates]:
    """The name of the lab and what selections can name; exits if the spec has errors.

    The spec is not read if ``name`` is given and all selections are names or ranges of hosts and robots that
    this lab has. Raises ``LabError``.
    """
    from swarmctl.lab import lab as labs
    from swarmctl.lab.lab_candidates import candidates_of, names_all

    if name:
        known = candidates_of(labs.plan(name))
        if names_all(known, selections):
            return name, known
    swarm = console.read_spec(spec)
    return name or swarm.name, swarm.candidates


def _chosen_robots(spec: SpecFiles, name: str, selections: list[str]) -> tuple[str, list[str]]:
    """The name of the lab, and its selected robots with cables; exits without any. Raises ``LabError``."""
    from swarmctl.lab import lab as labs

    which, known = _candidates(spec, name, selections)
    found = selected.robots(known, selections, "ROBOT")
    return which, _there(which, found, [one.name for one in labs.plan(which).robots], "cable of ")


def _chosen_hosts(
    spec: SpecFiles, name: str, selections: list[str], network: str = "", option: str = "HOST"
) -> tuple[str, list[str]]:
    """The same for hosts. If several are selected, those outside ``network`` are left out."""
    from swarmctl.lab import lab as labs

    which, known = _candidates(spec, name, selections)
    found = selected.hosts(known, selections, option)
    plan = labs.plan(which)
    there = _there(which, found, [one.name for one in plan.hosts])
    on = [one for one in there if not network or network in {at.network for at in plan.host(one).interfaces}]
    return which, on or there[:1]  # the lab names the networks of a host that is not on this one


def _there(lab_name: str, chosen: list[str], known: list[str], what: str = "") -> list[str]:
    """Those of ``chosen`` that a lab of a part of the swarm has; prints a note on the others."""
    from swarmctl.yamltext import hostlist

    found = [one for one in chosen if one in known]
    lacking = hostlist.written(one for one in chosen if one not in known)
    if not found:
        there = f"{what and 'those of '}{hostlist.written(known)}" if known else "none"
        console.fail(f"lab {lab_name} has no {what}{lacking}", f"it has {there}")
    if lacking:
        console.show(f"note: lab {lab_name} has no {what}{lacking}", error=True)
    return found


def _done(spec: SpecFiles, name: str, what: str, chosen: list[str]) -> None:
    """Print what is true now of the chosen hosts or robots."""
    from swarmctl.yamltext import hostlist

    console.out().print(f"{hostlist.written(chosen)}: {what}")
    next_command.advise("status", spec, *next_command.where(lab=True, lab_name=name))
