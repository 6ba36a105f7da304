"""``swarmctl validate``: is the spec right, and if not, where."""

from __future__ import annotations

from typing import Annotated

import typer

from swarmctl.cli import access, console, exits


def validate(
    spec: access.Spec,
    json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
) -> None:
    """Check a spec. Exit code 0 when it can be deployed, 1 when not."""
    from swarmctl.checks.check import read
    from swarmctl.views import diagnostics as view

    swarm, diagnostics = read(spec)
    if json:
        console.print_json(
            {"v": 1, "valid": swarm is not None, "diagnostics": [one.to_json() for one in diagnostics]}
        )
    else:
        console.print_diagnostics(diagnostics)
        if swarm is None:
            console.err().print(f"{view.summary(diagnostics)} in {spec}")
        else:
            found = f" ({view.summary(diagnostics)})" if diagnostics else ""
            console.out().print(
                f"{spec}: swarm `{swarm.name}` is valid{found}: "
                f"{len(swarm.robots)} robots on {len(swarm.hosts)} hosts, mode {swarm.mode.value}"
            )
    raise typer.Exit(exits.OK if swarm is not None else exits.ERROR)
