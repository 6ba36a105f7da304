"""``swarmctl lab``: the swarm on this machine, with real hosts and emulated robots."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from swarmctl.cli import access, console, exits, firmware
from swarmctl.cli.layers import Layers

lab = typer.Typer(
    help="The swarm on this machine: real hosts in namespaces, emulated robots.",
    no_args_is_help=True,
    rich_markup_mode=None,
    epilog=exits.told(),
)

Name = Annotated[
    str, typer.Option("--name", metavar="NAME", help="The lab's name; the swarm's own by default.")
]
Host = Annotated[str, typer.Argument(help="A host of the spec.")]
Network = Annotated[
    str, typer.Option("--network", metavar="NAME", help="Only this network; all of the host's by default.")
]
Robot = Annotated[str, typer.Argument(help="A robot of the spec.")]


@contextmanager
def _told() -> Iterator[None]:
    """Let a lab's complaint end the program with its help, not with a traceback."""
    from swarmctl.lab.errors import LabError

    try:
        yield
    except LabError as error:
        console.fail(str(error), *error.help_lines)


def _name(spec: Layers | None, name: str) -> str:
    """The lab that is meant. Its name, where it is given, spares reading the spec."""
    return name if name or spec is None else console.read_spec(spec).name


@lab.command(epilog=exits.told())
def up(
    spec: access.Spec,
    overlays: access.Overlays = None,
    name: Name = "",
    workspace: Annotated[
        Path | None,
        typer.Option(
            "--workspace", metavar="DIR", help="A built catkin workspace, to be found by ROS on every host."
        ),
    ] = None,
    boards: Annotated[
        bool,
        typer.Option(
            "--boards", help="Build the sketches of robots with an Arduino, and run them on simulated ones."
        ),
    ] = False,
) -> None:
    """Boot the hosts of a spec, at its own addresses, with its robots on their lines. Needs root."""
    from swarmctl.lab import lab as labs
    from swarmctl.lab.emulated import own_emulators
    from swarmctl.lab.plan import plan_of
    from swarmctl.lab.workspace import workspace_of

    swarm = console.read_spec(spec)
    with _told():
        own = own_emulators(spec.files[0].resolve().parent / "robots")
        plan = plan_of(swarm, name or None, own, firmware.simulated(swarm) if boards else {})
        if workspace is not None:
            place = swarm.workspace or f"/opt/ros/{swarm.distro}"
            plan = replace(plan, workspace=workspace_of(workspace, place))
        labs.up(plan, lambda line: console.err().print(line))


@lab.command(epilog=exits.told())
def down(
    spec: access.AnySpec,
    overlays: access.Overlays = None,
    name: Name = "",
    every: Annotated[bool, typer.Option("--all", help="Every lab in the state folder.")] = False,
) -> None:
    """Remove a lab and everything it left: processes, mounts, namespaces, disks."""
    from swarmctl.lab import lab as labs
    from swarmctl.lab import places

    with _told():
        if every:
            names = [place.name for place in places.homes()]
        elif name or spec:
            names = [_name(spec, name)]
        else:
            console.fail("which lab?", "give its spec, --name or --all")
        for one in names:
            console.err().print(f"lab {one}: {'removed' if labs.down(one) else 'there was none'}")


@lab.command(epilog=exits.told())
def status(
    spec: access.Spec, overlays: access.Overlays = None, name: Name = "", json: access.Json = False
) -> None:
    """Show the hosts of a lab, whether they run, and the networks they are on."""
    from swarmctl.lab import lab as labs
    from swarmctl.views import lab as view

    with _told():
        found = labs.status(_name(spec, name))
    if json:
        console.print_json({"v": 1} | found)
    else:
        console.out().print(view.hosts(found))


@lab.command(epilog=exits.told())
def robots(
    spec: access.Spec, overlays: access.Overlays = None, name: Name = "", json: access.Json = False
) -> None:
    """Show where the robots of a lab truly are, and how fast their wheels turn."""
    from swarmctl.lab import lab as labs
    from swarmctl.views import lab as view

    with _told():
        found = labs.robots(_name(spec, name))
    if json:
        console.print_json({"v": 1, "robots": found})
    else:
        console.out().print(view.robots(found))


@lab.command(epilog=exits.told(), context_settings={"ignore_unknown_options": True})
def shell(
    spec: access.Spec,
    host: Annotated[
        str, typer.Argument(help="A host of the spec, or `operator`: this machine, in the lab's network.")
    ],
    command: Annotated[
        list[str] | None, typer.Argument(help="A command instead of a shell, after `--`.")
    ] = None,
    overlays: access.Overlays = None,
    name: Name = "",
) -> None:
    """Open a shell on a host over SSH, or run a command there, and end with its exit code."""
    from swarmctl.lab import lab as labs
    from swarmctl.lab import network
    from swarmctl.lab.plan import OPERATOR

    with _told():
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


@lab.command(epilog=exits.told())
def unplug(spec: access.Spec, robot: Robot, overlays: access.Overlays = None, name: Name = "") -> None:
    """Pull a robot's cable. The robot goes on as it was last told."""
    from swarmctl.lab import lab as labs

    with _told():
        labs.unplug(_name(spec, name), robot)


@lab.command(epilog=exits.told())
def plug(spec: access.Spec, robot: Robot, overlays: access.Overlays = None, name: Name = "") -> None:
    """Put a robot's cable back."""
    from swarmctl.lab import lab as labs

    with _told():
        labs.plug(_name(spec, name), robot)


@lab.command(epilog=exits.told())
def cut(
    spec: access.Spec, host: Host, overlays: access.Overlays = None, name: Name = "", network: Network = ""
) -> None:
    """Cut a host off its networks."""
    from swarmctl.lab import lab as labs

    with _told():
        labs.cut(_name(spec, name), host, network or None)


@lab.command(epilog=exits.told())
def join(
    spec: access.Spec, host: Host, overlays: access.Overlays = None, name: Name = "", network: Network = ""
) -> None:
    """Let a host back onto its networks."""
    from swarmctl.lab import lab as labs

    with _told():
        labs.join(_name(spec, name), host, network or None)


@lab.command(epilog=exits.told())
def kill(spec: access.Spec, host: Host, overlays: access.Overlays = None, name: Name = "") -> None:
    """Cut a host's power; its disk stays as it is."""
    from swarmctl.lab import lab as labs

    with _told():
        labs.kill(_name(spec, name), host)


@lab.command(epilog=exits.told())
def start(spec: access.Spec, host: Host, overlays: access.Overlays = None, name: Name = "") -> None:
    """Switch a host on again."""
    from swarmctl.lab import lab as labs

    with _told():
        labs.start(_name(spec, name), host, lambda line: console.err().print(line))
