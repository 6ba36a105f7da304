"""Arguments and options that verbs share, and the SSH targets that they select."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swarmctl.cli import console, spec_args
from swarmctl.cli.spec_args import SpecFiles

if TYPE_CHECKING:
    from swarmctl.remote.transport import Target
    from swarmctl.render.bundle import Bundle
    from swarmctl.swarm.resolved import Swarm

_SPEC: Any = {
    "metavar": "SPEC",
    "parser": spec_args.file,
    "default_factory": lambda: None,
    "show_default": False,
}
Spec = Annotated[SpecFiles, typer.Argument(help="The swarm's YAML file.", callback=spec_args.needed, **_SPEC)]
Specs = Annotated[
    list[SpecFiles], typer.Argument(help="YAML files, one swarm each.", callback=spec_args.each, **_SPEC)
]
AnySpec = Annotated[
    SpecFiles | None, typer.Argument(help="The swarm's YAML file.", callback=spec_args.given, **_SPEC)
]
Overlays = Annotated[
    list[Path] | None,
    typer.Option(
        "--file", "-f", metavar="FILE", is_eager=True,
        help="Overlay this file on SPEC (repeatable); without SPEC, the first file is the spec.",
    ),
]  # fmt: skip
Workspaces = Annotated[
    list[Path] | None,
    typer.Option(
        "--workspace", metavar="DIR", is_eager=True, exists=True, file_okay=False,
        help="Read the ROS packages in this folder too, beside those in the folder of SPEC (repeatable).",
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
Limit = Annotated[
    list[str] | None, typer.Option("--limit", metavar="HOST", help="Only this host (repeatable).")
]
Parallel = Annotated[
    int, typer.Option("--parallel", metavar="N", min=1, max=512, help="Number of hosts at the same time.")
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document on stdout.")]

Color = Annotated[
    console.Colour | None,
    typer.Option(
        "--color", callback=console.choose_colour, show_default=False,
        help="Colour; auto, the default, depends on the terminal, NO_COLOR, FORCE_COLOR and TERM.",
    ),
]  # fmt: skip


def chosen(known: Iterable[str], limit: list[str] | None) -> list[str]:
    """The hosts in ``--limit``, or all hosts without it; exits with an error for an unknown name."""
    from swarmctl.suggest import did_you_mean

    names = list(known)
    for name in limit or ():
        if name not in names:
            console.fail(
                f"--limit: there is no host called `{name}`", *did_you_mean(name, names, "the hosts are")
            )
    return [name for name in names if not limit or name in limit]


def in_lab(lab: bool, lab_name: str) -> bool:
    """True if the hosts are those of a lab. The journal of real deploys leaves them out."""
    return lab or bool(lab_name)


def targets(spec: SpecFiles, swarm: Swarm, *, lab: bool, lab_name: str) -> Mapping[str, Target]:
    """The SSH target of each host. With ``lab``, this process enters the network namespace of the lab."""
    return (
        _lab_targets(lab_name or swarm.name, spec, swarm)
        if in_lab(lab, lab_name)
        else _real_targets(spec, swarm)
    )


def secrets(spec: SpecFiles, wanted: Mapping[str, Bundle]) -> Mapping[str, str]:
    """The secrets of the hosts that the operator has; exits with an error for an unusable one."""
    from swarmctl.deploy.secrets import SecretError, found

    names = dict.fromkeys(name for bundle in wanted.values() for name in bundle.secrets)
    try:
        return found(names, spec.first.parent)
    except SecretError as error:
        console.fail(str(error), error.fix)


def _lab_targets(name: str, spec: SpecFiles, swarm: Swarm) -> Mapping[str, Target]:
    from swarmctl.lab import lab as labs
    from swarmctl.lab.errors import LabError
    from swarmctl.lab.hosts import network
    from swarmctl.remote.transport import Target

    try:
        operator = labs.operator(name)
        network.enter(operator.namespace)
    except LabError as error:
        console.fail(str(error), *(error.help_lines or (f"swarmctl lab up {spec}",)))
    return {
        host.name: Target(
            host.name,
            host.address,
            host.user,
            host.port,
            operator.keys.get(host.name, ()),
            (operator.identity,),
        )
        for host in swarm.hosts.values()
    }


def _real_targets(spec: SpecFiles, swarm: Swarm) -> Mapping[str, Target]:
    from swarmctl.cli import ssh_targets as real

    found, warnings = real.targets(swarm, real.read_known_hosts(spec.first))
    for warning in warnings:
        console.err().print(f"warning: {warning}")
    return found
