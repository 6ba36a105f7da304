"""``swarmctl lab fault``, with a verb for each kind of fault, and ``swarmctl lab repair``."""

from __future__ import annotations

import inspect
from typing import Annotated, Any

import typer

from swarmctl.cli import complete, console, exit_codes, lab_targets, options
from swarmctl.cli.spec_args import SpecFiles
from swarmctl.cli.where import Where
from swarmctl.lab.faults.fault_kind import FaultKind
from swarmctl.lab.faults.kinds import KINDS

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
    with lab_targets.errors(spec, name):
        if kind.of_robots:
            which, chosen = lab_targets.robots(spec, name, selections)
        else:
            network = text if kind.option is not None and kind.option.name == "network" else ""
            which, chosen = lab_targets.hosts(spec, name, selections, network)
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
        "name": (lab_targets.Name, ""),
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
    name: lab_targets.Name = "",
) -> None:
    """End all faults of a lab, or those of the targets, and wait until their hosts answer SSH."""
    from swarmctl.lab import lab as labs
    from swarmctl.yamltext import hostlist

    with lab_targets.errors(spec, name):
        which, hosts, robots = lab_targets.hosts_and_robots(spec, name, targets or [])
        labs.repair(which, lambda line: console.show(line, error=True), hosts, robots)
    chosen = hostlist.written([*(hosts or ()), *(robots or ())])
    console.out().print(f"{chosen or f'lab {which}'}: no faults")
    Where(spec, lab=True, lab_name=name).advise("status")
