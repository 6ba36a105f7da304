"""How the verbs reach hosts: pinned keys and ~/.ssh/config for real ones, the lab's own for its hosts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swarmctl.cli import console, layers
from swarmctl.cli.layers import Layers

if TYPE_CHECKING:
    from swarmctl.remote.transport import Target
    from swarmctl.render.bundle import Bundle
    from swarmctl.topology.swarm import Swarm

_SPEC: Any = {
    "metavar": "SPEC",
    "parser": layers.file,
    "default_factory": lambda: None,
    "show_default": False,
}
Spec = Annotated[Layers, typer.Argument(help="The swarm's YAML file.", callback=layers.needed, **_SPEC)]
Specs = Annotated[
    list[Layers], typer.Argument(help="YAML files, each a swarm's.", callback=layers.each, **_SPEC)
]
AnySpec = Annotated[
    Layers | None, typer.Argument(help="The swarm's YAML file.", callback=layers.given, **_SPEC)
]
Overlays = Annotated[
    list[Path] | None,
    typer.Option(
        "--file", "-f", metavar="FILE", is_eager=True,
        help="Lay this file over SPEC (repeatable); without SPEC the first one is the spec.",
    ),
]  # fmt: skip
Lab = Annotated[
    bool, typer.Option("--lab", help="Reach the hosts of the running lab instead of the real ones.")
]
LabName = Annotated[
    str, typer.Option("--lab-name", metavar="NAME", help="The lab, when it is not called as the swarm is.")
]
Limit = Annotated[
    list[str] | None, typer.Option("--limit", metavar="HOST", help="Only this host (repeatable).")
]
Parallel = Annotated[int, typer.Option("--parallel", metavar="N", min=1, max=512, help="Hosts at a time.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document on stdout.")]

Color = Annotated[
    console.Colour | None,
    typer.Option(
        "--color", callback=console.choose_colour, show_default=False,
        help="Colour; auto, the default, heeds the terminal, NO_COLOR, FORCE_COLOR and TERM.",
    ),
]  # fmt: skip


def chosen(known: Iterable[str], limit: list[str] | None) -> list[str]:
    """The hosts that ``--limit`` names, all without it; an unknown name ends the program."""
    from swarmctl.spec.suggest import did_you_mean

    names = list(known)
    for name in limit or ():
        if name not in names:
            console.fail(
                f"--limit: there is no host called `{name}`", *did_you_mean(name, names, "the hosts are")
            )
    return [name for name in names if not limit or name in limit]


def in_lab(lab: bool, lab_name: str) -> bool:
    """Whether the hosts are those of a lab. What happens to them is no news of the real ones."""
    return lab or bool(lab_name)


def targets(spec: Layers, swarm: Swarm, *, lab: bool, lab_name: str) -> Mapping[str, Target]:
    """How to reach every host. With ``lab``, this process moves into the lab's network for good."""
    return (
        _lab_targets(lab_name or swarm.name, spec, swarm)
        if in_lab(lab, lab_name)
        else _real_targets(spec, swarm)
    )


def secrets(spec: Layers, wanted: Mapping[str, Bundle]) -> Mapping[str, str]:
    """The operator's part of the secrets that the hosts need; what cannot be one ends the program."""
    from swarmctl.deploy.secrets import SecretError, found

    names = dict.fromkeys(name for bundle in wanted.values() for name in bundle.secrets)
    try:
        return found(names, spec.first.parent)
    except SecretError as error:
        console.fail(str(error), error.mend)


def _lab_targets(name: str, spec: Layers, swarm: Swarm) -> Mapping[str, Target]:
    from swarmctl.lab import lab as labs
    from swarmctl.lab import network
    from swarmctl.lab.errors import LabError
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


def _real_targets(spec: Layers, swarm: Swarm) -> Mapping[str, Target]:
    from swarmctl.cli import targets as real

    found, warnings = real.targets(swarm, real.read_lock(spec.first))
    for warning in warnings:
        console.err().print(f"warning: {warning}")
    return found
