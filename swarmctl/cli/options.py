"""Arguments and options that verbs share, and the SSH targets that they select."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from swarmctl.cli import console, exit_codes, spec_args
from swarmctl.cli.spec_args import SpecFiles

if TYPE_CHECKING:
    from swarmctl.cli.ssh_targets import NamedHosts
    from swarmctl.remote.transport import Target
    from swarmctl.render.bundle import Bundle
    from swarmctl.spec.load import Document

_Format = TypeVar("_Format", bound=Enum)

_SPEC: Any = {
    "metavar": "SPEC",
    "parser": spec_args.file,
    "default_factory": lambda: None,
    "show_default": False,
}
Spec = Annotated[SpecFiles, typer.Argument(help="The swarm's YAML file.", callback=spec_args.needed, **_SPEC)]
SpecOrReport = Annotated[
    SpecFiles,
    typer.Argument(help="The swarm's YAML file.", callback=spec_args.needed_without_report, **_SPEC),
]
Archive = Annotated[
    Path | None,
    typer.Option(
        "--from", metavar="ARCHIVE", is_eager=True,
        help="Show what is in an archive of `swarmctl report`; connect to no host.",
    ),
]  # fmt: skip
Specs = Annotated[
    list[SpecFiles], typer.Argument(help="YAML files, one swarm each.", callback=spec_args.each, **_SPEC)
]
AnySpec = Annotated[
    SpecFiles | None, typer.Argument(help="The swarm's YAML file.", callback=spec_args.given, **_SPEC)
]
_FILE: Any = {
    "metavar": "FILE",
    "is_eager": True,
    "help": "Overlay this file on SPEC (repeatable); without SPEC, the first file is the spec.",
}
Overlays = Annotated[list[Path] | None, typer.Option("--file", "-f", **_FILE)]
LongOverlays = Annotated[list[Path] | None, typer.Option("--file", **_FILE)]  # where -f means something else
Workspaces = Annotated[
    list[Path] | None,
    typer.Option(
        "--workspace", metavar="DIR", is_eager=True, exists=True, file_okay=False,
        help="Read the ROS packages in this folder too, beside those in the folder of SPEC (repeatable).",
    ),
]  # fmt: skip
Into = Annotated[
    Path | None,
    typer.Option(
        "--into", metavar="FILE",
        help="Write edits of hosts into this overlay (-f) instead of where their values stand.",
    ),
]  # fmt: skip
Lab = Annotated[
    bool, typer.Option("--lab", help="Use the hosts of the running lab instead of the real hosts.")
]
LabName = Annotated[
    str,
    typer.Option(
        "--lab-name", metavar="NAME", help="The name of the lab, if it differs from the name of the swarm."
    ),
]


def format_of(form: _Format | None, json: bool, usual: _Format) -> _Format:
    """The format that ``--format`` and ``--json`` choose together; exits if they exclude each other."""
    if json and form is not None and form.value != "json":
        console.fail(f"--json and --format {form.value} exclude each other", code=exit_codes.USAGE)
    chosen = type(usual)("json") if json else form or usual
    console.choose_json(chosen.value == "json")
    return chosen


def _offered(context: typer.Context, incomplete: str) -> list[str]:
    from swarmctl.cli import complete  # the help needs none of it

    return complete.selections(context, incomplete)


_LIMIT: Any = {
    "metavar": "SELECTION",
    "autocompletion": _offered,
    "help": "Only these hosts, or those of these robots: pi-*, @group, type:epuck2, !k3 (repeatable).",
}
Limit = Annotated[list[str] | None, typer.Option("--limit", **_LIMIT)]
Selection = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="SELECTION",
        help="Only these robots, programs, hosts: k3, program:map, pi-*, @group, !k3.",
        autocompletion=_offered,
    ),
]
HostOrLimit = Annotated[list[str] | None, typer.Option("--host", "--limit", **_LIMIT)]
PARALLEL = 64  # hosts at the same time
PARALLEL_URGENT = 256  # of `stop` and its like
Parallel = Annotated[
    int, typer.Option("--parallel", metavar="N", min=1, max=512, help="Number of hosts at the same time.")
]
WINDOW = 2.0  # s
Window = Annotated[
    float,
    typer.Option(
        "--window", min=0.5, max=10.0, metavar="SECONDS", help="How long the rate of each topic is measured."
    ),
]
StopRobots = Annotated[
    bool,
    typer.Option("--stop-robots", help="Stop robots that move or are under command; they stay stopped."),
]
Json = Annotated[
    bool,
    typer.Option("--json", callback=console.choose_json, help="Print one JSON document on stdout."),
]
FormatJson = Annotated[bool, typer.Option("--json", help="The same as --format json.")]
Details = Annotated[
    bool, typer.Option("--details", "-v", help="Show every host and every step, equal ones too.")
]

Color = Annotated[
    console.Colour | None,
    typer.Option(
        "--color", callback=console.choose_colour, show_default=False,
        help="Colour; auto, the default, depends on the terminal, NO_COLOR, FORCE_COLOR and TERM.",
    ),
]  # fmt: skip


def in_lab(lab: bool, lab_name: str) -> bool:
    """True if the hosts are those of a lab. The journal of real deploys leaves them out."""
    return lab or bool(lab_name)


def lab_of(document: Document, lab: bool, lab_name: str) -> str:
    """The name of the lab that the options mean; empty for the real hosts."""
    return lab_named(document.spec.name, lab, lab_name)


def lab_named(swarm: str, lab: bool, lab_name: str) -> str:
    """The name of the lab that the options mean for a swarm; empty for the real hosts."""
    return lab_name or swarm if in_lab(lab, lab_name) else ""


def targets(spec: SpecFiles, swarm: NamedHosts, *, lab: bool, lab_name: str) -> Mapping[str, Target]:
    """The SSH target of each host. With ``lab``, this process enters the network namespace of the lab."""
    from swarmctl.cli import pin_file

    found = (
        _lab_targets(lab_name or swarm.name, spec, swarm)
        if in_lab(lab, lab_name)
        else _real_targets(spec, swarm)
    )
    expelled = pin_file.expelled(spec, swarm.name, lab_named(swarm.name, lab, lab_name))
    return {name: _without(expelled, target) for name, target in found.items()} if expelled else found


def _without(expelled: Collection[str], target: Target) -> Target:
    jump = _without(expelled, target.jump) if target.jump is not None else None
    return replace(target, expelled=target.host in expelled, jump=jump)


def secrets(spec: SpecFiles, wanted: Mapping[str, Bundle]) -> Mapping[str, str]:
    """The secrets of the hosts that the operator has; exits with an error for an unusable one."""
    from swarmctl.deploy.secrets import SecretError, found

    names = dict.fromkeys(name for bundle in wanted.values() for name in bundle.secrets)
    found_forms = {one for bundle in wanted.values() for one in bundle.secret_forms.items()}
    forms = dict(sorted(found_forms, reverse=True))  # a variable's, `line`, comes after a file's, `text`
    try:
        return found(names, spec.first.parent, forms=forms)
    except SecretError as error:
        console.fail(str(error), error.fix)


def _lab_targets(name: str, spec: SpecFiles, swarm: NamedHosts) -> Mapping[str, Target]:
    from swarmctl.cli import next_command
    from swarmctl.lab import lab as labs
    from swarmctl.lab.errors import LabError
    from swarmctl.lab.hosts import network
    from swarmctl.remote.transport import Target

    try:
        operator = labs.operator(name)
        network.enter(operator.namespace)
    except LabError as error:
        name = name if name != swarm.name else ""
        console.fail(str(error), *next_command.in_lab_errors(error.help_lines, spec, name))
    return {
        host.name: Target(
            host.name,
            operator.addresses.get(host.name, host.address),
            host.user,
            host.port,
            operator.keys.get(host.name, ()),
            (operator.identity,),
        )
        for host in swarm.hosts.values()
    }


def _real_targets(spec: SpecFiles, swarm: NamedHosts) -> Mapping[str, Target]:
    from swarmctl.cli import ssh_targets as real

    found, warnings = real.targets(swarm, real.read_known_hosts(spec.first))
    for warning in warnings:
        console.err().print(f"warning: {warning}")
    return found
