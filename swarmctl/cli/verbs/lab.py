"""``swarmctl lab``: runs the swarm on this machine, with real hosts and emulated robots."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from swarmctl.cli import console, exit_codes, options
from swarmctl.cli.spec_args import SpecFiles
from swarmctl.cli.verbs import firmware

lab = typer.Typer(
    help="Run the swarm on this machine: real hosts in namespaces, emulated robots.",
    no_args_is_help=True,
    rich_markup_mode=None,
    epilog=exit_codes.epilog(),
)

Name = Annotated[
    str, typer.Option("--name", metavar="NAME", help="The name of the lab; by default that of the swarm.")
]
Host = Annotated[str, typer.Argument(help="A host of the spec.")]
Network = Annotated[
    str,
    typer.Option("--network", metavar="NAME", help="Only this network; by default all networks of the host."),
]
Robot = Annotated[str, typer.Argument(help="A robot of the spec.")]


@contextmanager
def _lab_errors() -> Iterator[None]:
    """Exit with message and help for an error of the lab."""
    from swarmctl.lab.errors import LabError

    try:
        yield
    except LabError as error:
        console.fail(str(error), *error.help_lines)


def _name(spec: SpecFiles | None, name: str) -> str:
    """The name of the lab; the spec is read only without a given name."""
    return name if name or spec is None else console.read_spec(spec).name


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
) -> None:
    """Boot the hosts of a spec at their addresses, with emulated robots on their lines. Needs root."""
    from swarmctl.lab import lab as labs
    from swarmctl.lab.emulators.emulator_lookup import user_emulators
    from swarmctl.lab.hosts.workspace import installed, workspace_of
    from swarmctl.lab.lab_plan import plan_of

    swarm = console.read_spec(spec)
    with _lab_errors():
        own = user_emulators(spec.files[0].resolve().parent / "robots")
        plan = plan_of(swarm, name or None, own, firmware.simulated(swarm) if boards else {})
        if workspace is not None:
            place = swarm.workspace or installed(swarm.distro)
            plan = replace(plan, workspace=workspace_of(workspace, place))
        labs.up(plan, lambda line: console.err().print(line))


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

    with _lab_errors():
        if every:
            names = [place.name for place in paths.all_labs()]
        elif name or spec:
            names = [_name(spec, name)]
        else:
            console.fail("the lab is missing", "give its spec, --name or --all")
        for one in names:
            console.err().print(f"lab {one}: {'removed' if labs.down(one) else 'does not exist'}")


@lab.command(epilog=exit_codes.epilog())
def status(
    spec: options.Spec, overlays: options.Overlays = None, name: Name = "", json: options.Json = False
) -> None:
    """Show the hosts of a lab, their state and their networks."""
    from swarmctl.lab import lab as labs
    from swarmctl.views import lab as view

    with _lab_errors():
        found = labs.status(_name(spec, name))
    if json:
        console.print_json({"v": 1} | found)
    else:
        console.out().print(view.hosts(found))


@lab.command(epilog=exit_codes.epilog())
def robots(
    spec: options.Spec, overlays: options.Overlays = None, name: Name = "", json: options.Json = False
) -> None:
    """Show the true poses and wheel speeds of the robots of a lab."""
    from swarmctl.lab import lab as labs
    from swarmctl.views import lab as view

    with _lab_errors():
        found = labs.robots(_name(spec, name))
    if json:
        console.print_json({"v": 1, "robots": found})
    else:
        console.out().print(view.robots(found))


@lab.command(epilog=exit_codes.epilog(), context_settings={"ignore_unknown_options": True})
def shell(
    spec: options.Spec,
    host: Annotated[
        str, typer.Argument(help="A host of the spec, or `operator`: this machine, in the lab's network.")
    ],
    command: Annotated[
        list[str] | None, typer.Argument(help="A command instead of a shell, after `--`.")
    ] = None,
    overlays: options.Overlays = None,
    name: Name = "",
) -> None:
    """Open a shell on a host over SSH, or run a command there and exit with its exit code."""
    from swarmctl.lab import lab as labs
    from swarmctl.lab.hosts import network
    from swarmctl.lab.lab_plan import OPERATOR

    with _lab_errors():
        which = _name(spec, name)
        meeting = labs.operator(which)
        if host == OPERATOR:
            argv = tuple(command or (os.environ.get("SHELL", "/bin/sh"),))
        else:
            argv = labs.ssh_argv(which, host, command or ())
        network.enter(meeting.namespace)
    try:
        os.execvp(argv[0], argv)
    except OSError as error:
        console.fail(f"cannot run {argv[0]}: {error.strerror}")


@lab.command(epilog=exit_codes.epilog())
def unplug(spec: options.Spec, robot: Robot, overlays: options.Overlays = None, name: Name = "") -> None:
    """Disconnect a robot's cable. The robot keeps executing its last command."""
    from swarmctl.lab import lab as labs

    with _lab_errors():
        labs.unplug(_name(spec, name), robot)


@lab.command(epilog=exit_codes.epilog())
def plug(spec: options.Spec, robot: Robot, overlays: options.Overlays = None, name: Name = "") -> None:
    """Reconnect a robot's cable."""
    from swarmctl.lab import lab as labs

    with _lab_errors():
        labs.plug(_name(spec, name), robot)


@lab.command(epilog=exit_codes.epilog())
def cut(
    spec: options.Spec, host: Host, overlays: options.Overlays = None, name: Name = "", network: Network = ""
) -> None:
    """Disconnect a host from its networks."""
    from swarmctl.lab import lab as labs

    with _lab_errors():
        labs.cut(_name(spec, name), host, network or None)


@lab.command(epilog=exit_codes.epilog())
def join(
    spec: options.Spec, host: Host, overlays: options.Overlays = None, name: Name = "", network: Network = ""
) -> None:
    """Reconnect a host to its networks."""
    from swarmctl.lab import lab as labs

    with _lab_errors():
        labs.join(_name(spec, name), host, network or None)


@lab.command(epilog=exit_codes.epilog())
def kill(spec: options.Spec, host: Host, overlays: options.Overlays = None, name: Name = "") -> None:
    """Cut a host's power; its disk stays."""
    from swarmctl.lab import lab as labs

    with _lab_errors():
        labs.kill(_name(spec, name), host)


@lab.command(epilog=exit_codes.epilog())
def start(spec: options.Spec, host: Host, overlays: options.Overlays = None, name: Name = "") -> None:
    """Switch a host on again."""
    from swarmctl.lab import lab as labs

    with _lab_errors():
        labs.start(_name(spec, name), host, lambda line: console.err().print(line))
