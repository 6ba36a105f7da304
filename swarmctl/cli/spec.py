"""``swarmctl spec``: a spec in its flat form, and where each of its values comes from."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from swarmctl.cli import access, console, exits


def spec(
    spec: access.Spec,
    overlays: access.Overlays = None,
    expanded: Annotated[
        bool, typer.Option("--expanded", help="Print the flat form; it is the only form so far.")
    ] = True,
    origins: Annotated[
        bool, typer.Option("--origins", help="Say beside each value where it comes from.")
    ] = False,
    json: access.Json = False,
) -> None:
    """Print a spec in its flat form: files joined, ranges written out, defaults and types worked in.

    What is printed is a spec of the same swarm. Types of your own in `robots/` are looked up there as before.
    """
    from swarmctl.checks.check import check
    from swarmctl.spec.diagnostics import has_errors, in_order
    from swarmctl.spec.flat import flat
    from swarmctl.spec.load import load
    from swarmctl.views import flat as view
    from swarmctl.views.findings import human
    from swarmctl.views.findings.report import Checked

    document, found = load(spec.files)
    found = check(document, found) if document else in_order(found)
    if document is None or has_errors(found):
        console.print_diagnostics(found)
        console.err().print(human.verdict(Checked(str(spec), None, found), passes=False))
        raise typer.Exit(exits.ERROR)
    made = flat(document, [str(file) for file in spec.files[1:]])
    if json:
        console.print_json({"v": 1, **view.json_of(made)})
    else:
        sys.stdout.write(view.yaml_of(made, origins=origins))
