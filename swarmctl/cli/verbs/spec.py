"""``swarmctl spec``: prints the effective spec and the origin of each value."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from swarmctl.cli import console, options


def spec(
    spec: options.Spec,
    overlays: options.Overlays = None,
    expanded: Annotated[
        bool, typer.Option("--expanded", help="Print the effective spec; this is the only form so far.")
    ] = True,
    origins: Annotated[
        bool, typer.Option("--origins", help="Add the origin of each value as a comment.")
    ] = False,
    json: options.Json = False,
) -> None:
    """Print the effective spec: files merged, ranges and selections expanded, defaults applied.

    The output is a spec of the same swarm. Your own types are still read from `robots/`.
    """
    from swarmctl.cli.spec_fixes import checked
    from swarmctl.diagnostics import has_errors, in_order
    from swarmctl.linter.runner import lint
    from swarmctl.spec.effective_spec import flat
    from swarmctl.spec.load import load
    from swarmctl.views import effective_spec as view

    document, found = load(spec.files)
    found = lint(document, found) if document else in_order(found)
    if document is None or has_errors(found):
        console.refuse(spec, checked(spec))
    made = flat(document, [str(file) for file in spec.files[1:]])
    if json:
        console.print_json({"v": 1, **view.json_of(made)})
    else:
        sys.stdout.write(view.yaml_of(made, origins=origins))
