"""``swarmctl validate``: are the specs right, and if not, where."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swarmctl.cli import access, console, exits, findings
from swarmctl.cli import fix as fixes


def validate(
    specs: access.Specs,
    overlays: access.Overlays = None,
    form: Annotated[
        findings.Format | None,
        typer.Option("--format", help="How findings are shown; in GitHub Actions github, else human."),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="The same as --format json.")] = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Write the findings to a file.")
    ] = None,
    fix: Annotated[
        bool, typer.Option("--fix", help="Mend what can be mended, in the files themselves.")
    ] = False,
    diff: Annotated[
        bool,
        typer.Option("--diff", help="Only show what --fix would change; exit code 1 if that is something."),
    ] = False,
    strict: Annotated[bool, typer.Option("--strict", help="Let warnings fail, too.")] = False,
    quiet: Annotated[
        bool, typer.Option("--quiet", "-q", help="Print nothing: the exit code says it.")
    ] = False,
    color: access.Color = None,
) -> None:
    """Check specs. Exit code 0 when all of them can be deployed, 1 when not."""
    from swarmctl.checks.check import examine
    from swarmctl.views.findings.report import Checked, Report

    if json and form not in (None, findings.Format.JSON):
        console.fail(f"--json and --format {form.value} exclude each other", code=exits.USAGE)
    if diff:
        raise typer.Exit(exits.ERROR if fixes.show_diffs(specs) else exits.OK)
    if fix:
        fixes.apply_fixes(specs, quiet=quiet)
    report = Report(tuple(Checked(str(spec), *examine(*spec.files)) for spec in specs), strict=strict)
    findings.show(report, findings.Format.JSON if json else form or findings.usual(), output, quiet=quiet)
    raise typer.Exit(exits.OK if report.passed else exits.ERROR)
