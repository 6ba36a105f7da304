"""``swarmctl lab``: runs a swarm on this machine, causes faults and repairs them."""

from __future__ import annotations

import inspect
import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swarmctl.cli import complete, console, exit_codes, lab_selection, options, selected, spec_args
from swarmctl.cli.spec_args import SpecFiles
from swarmctl.cli.verbs import firmware, lab_scenario
from swarmctl.cli.where import Where
from swarmctl.lab.faults.fault_kind import FaultKind
from swarmctl.lab.faults.kinds import KINDS

if TYPE_CHECKING:
    from swarmctl.swarm.resolved import Swarm


Hosts = Annotated[
    list[str],
    typer.Argument(
        metavar="HOST", help="Hosts, or those of robots: pi-*, @group, !k3.", autocompletion=complete.hosts
    ),
]
Robots = Annotated[
    list[str],
    typer.Argument(
        metavar="ROBOT", help="Robots: k3, ep-[1-6], type:epuck2, @group.", autocompletion=complete.robots
    ),
]
Targets = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="TARGET",
        help="Hosts with their robots, or robots: k3-pi, k3, @group; by default the whole lab.",
        autocompletion=complete.hosts_and_robots,
    ),
]

fault = typer.Typer(
    help="Cause a fault of hosts or robots on purpose; `lab repair` ends it.",
    no_args_is_help=True,
    rich_markup_mode=None,
    epilog=exit_codes.epilog(),
)


def _cause(kind: FaultKind, spec: SpecFiles, selections: list[str], name: str, text: str) -> None:
    """Cause the fault at each selected host or robot, and print what is true of them now."""
    from swarmctl.lab import lab as labs
    from swarmctl.yamltext import hostlist

    value = _read(kind, text)
    outcome: dict[str, list[str]] = {}
    with lab_selection.errors(spec, name):
        if kind.of_robots:
            which, chosen = lab_selection.robots(spec, name, selections)
        else:
            network = text if kind.option is not None and kind.option.name == "network" else ""
            which, chosen = lab_selection.hosts(spec, name, selections, network)
        for target in chosen:
            outcome.setdefault(labs.fault(which, kind.name, target, value), []).append(target)
    for what, targets in outcome.items():
        console.out().print(f"{hostlist.written(targets)}: {what}")
    Where(spec, lab=True, lab_name=name).advise("status")


def _read(kind: FaultKind, text: str) -> Any:
    """The value of the kind's option; exits with an error for a wrong one."""
    try:
        return kind.read(text or None)
    except ValueError as error:
        console.fail(str(error), code=exit_codes.USAGE)


def _verb(kind: FaultKind) -> Any:
    """A function with the arguments and the option of a kind, from which typer makes its verb."""
    option = kind.option

    def cause(spec: SpecFiles, targets: list[str], name: str, **more: Any) -> None:
        _cause(kind, spec, targets, name, (option and more[option.name]) or "")

    parameters = {
        "spec": (options.Spec, inspect.Parameter.empty),
        "targets": (Robots if kind.of_robots else Hosts, inspect.Parameter.empty),
        "overlays": (options.Overlays, None),
        "name": (lab_selection.Name, ""),
    }
    if option is not None:
        shown = typer.Option(f"--{option.name}", metavar=option.metavar, help=option.help)
        usual = inspect.Parameter.empty if option.needed else ""
        parameters[option.name] = (Annotated[str, shown], usual)
    keyword = inspect.Parameter.KEYWORD_ONLY
    cause.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [
            inspect.Parameter(word, keyword, default=usual, annotation=hint)
            for word, (hint, usual) in parameters.items()
        ]
    )
    cause.__annotations__ = {word: hint for word, (hint, _) in parameters.items()}
    return cause


for one in KINDS.values():
    fault.command(one.name, help=one.help, epilog=exit_codes.epilog())(_verb(one))


def repair(
    spec: options.Spec,
    targets: Targets = None,
    overlays: options.Overlays = None,
    name: lab_selection.Name = "",
) -> None:
    """End all faults of a lab, or those of the targets, and wait until their hosts answer SSH."""
    from swarmctl.lab import lab as labs
    from swarmctl.yamltext import hostlist

    with lab_selection.errors(spec, name):
        which, hosts, robots = lab_selection.hosts_and_robots(spec, name, targets or [])
        labs.repair(which, lambda line: console.show(line, error=True), hosts, robots)
    chosen = hostlist.written([*(hosts or ()), *(robots or ())])
    console.out().print(f"{chosen or f'lab {which}'}: no faults")
    Where(spec, lab=True, lab_name=name).advise("status")


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
    name: lab_selection.Name = "",
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
    from swarmctl.lab.lab_plan import part_of, plan_of

    swarm = console.read_spec(spec)
    with lab_selection.errors(spec, name):
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
    from swarmctl.lab.lab_plan import masters_for
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
    name: lab_selection.Name = "",
    every: Annotated[bool, typer.Option("--all", help="Remove every lab on this machine.")] = False,
) -> None:
    """Remove a lab: processes, mounts, namespaces and disks."""
    from swarmctl.lab import lab as labs
    from swarmctl.lab import paths

    with lab_selection.errors(spec, name):
        if every:
            names = [place.name for place in paths.all_labs()]
        elif name or (spec := spec or spec_args.usual()):
            names = [lab_selection.name_of(spec, name)]
        else:
            console.fail("the lab is missing", "give its spec, --name or --all")
        for one in names:
            console.err().print(f"lab {one}: {'removed' if labs.down(one) else 'does not exist'}")


@lab.command(epilog=exit_codes.epilog())
def status(
    spec: options.Spec,
    overlays: options.Overlays = None,
    name: lab_selection.Name = "",
    limit: options.Limit = None,
    details: options.Details = False,
    json: options.Json = False,
) -> None:
    """Show the hosts of a lab, their state and their networks."""
    from swarmctl.lab import lab as labs
    from swarmctl.views import lab as view

    with lab_selection.errors(spec, name):
        if limit:
            which, chosen = lab_selection.hosts(spec, name, limit, option="--limit")
            found = labs.status(which)
            found["hosts"] = [host for host in found["hosts"] if host["name"] in chosen]
        else:
            found = labs.status(lab_selection.name_of(spec, name))
    if json:
        console.print_json({"v": 1} | found)
    else:
        console.out().print(view.hosts(found, details=details, width=console.columns()))
        Where(spec, lab=True, lab_name=name).advise("status")


@lab.command(epilog=exit_codes.epilog())
def robots(
    spec: options.Spec,
    overlays: options.Overlays = None,
    name: lab_selection.Name = "",
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

    with lab_selection.errors(spec, name):
        if limit:
            which, known = lab_selection.candidates(spec, name, limit)
            whole = labs.robots(which)
            chosen = lab_selection.there(which, selected.robots(known, limit, "--limit"), list(whole))
            found = {robot: whole[robot] for robot in chosen}
        else:
            found = labs.robots(lab_selection.name_of(spec, name))
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
    name: lab_selection.Name = "",
) -> None:
    """Open a shell on a host over SSH, or run a command there and exit with its exit code.

    On a host it has the ROS of its swarm (setup.bash), once that is deployed.
    """
    from swarmctl.lab import lab as labs
    from swarmctl.lab import lab as lines
    from swarmctl.lab.hosts import network
    from swarmctl.lab.lab_addresses import OPERATOR

    with lab_selection.errors(spec, name):
        which = lab_selection.name_of(spec, name)
        meeting = labs.operator(which)
        if host == OPERATOR:
            argv = lines.operator_argv(command or (), os.environ.get("SHELL", "/bin/sh"))
        else:
            host = selected.one(lab_selection.candidates(spec, name, [host])[1], host, "hosts", "HOST")
            line = lines.host_line(lines.setup_file(meeting.swarm), command or ())
            argv = labs.ssh_argv(which, host, (line,), terminal=_at_terminal())
        network.enter(meeting.namespace)
    try:
        os.execvp(argv[0], argv)
    except OSError as error:
        console.fail(f"cannot run {argv[0]}: {error.strerror}")


def _at_terminal() -> bool:
    return sys.stdin.isatty() and sys.stdout.isatty()


lab.add_typer(fault, name="fault")
lab.command(epilog=exit_codes.epilog())(repair)
lab.command(epilog=exit_codes.epilog(exit_codes.UNHEALTHY))(lab_scenario.scenario)
