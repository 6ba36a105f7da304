"""``swarmctl validate``: checks specs and prints the findings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swarmctl.cli import console, exit_codes, finding_output, next_command, options
from swarmctl.cli import finding_output as fixes
from swarmctl.cli.spec_fixes import checked


def validate(
    specs: options.Specs,
    overlays: options.Overlays = None,
    workspaces: options.Workspaces = None,
    form: Annotated[
        finding_output.Format | None,
        typer.Option("--format", help="Output format; by default github in GitHub Actions, else human."),
    ] = None,
    json: options.FormatJson = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Write the findings to a file.")
    ] = None,
    fix: Annotated[bool, typer.Option("--fix", help="Apply the safe fixes to the files.")] = False,
    unsafe: Annotated[
        bool,
        typer.Option("--unsafe-fixes", help="Apply the fixes that are guesses, too; review them."),
    ] = False,
    diff: Annotated[
        bool,
        typer.Option("--diff", help="Only show the changes of the fixes; exit code 1 if there are any."),
    ] = False,
    strict: Annotated[bool, typer.Option("--strict", help="Treat warnings as errors.")] = False,
    quiet: Annotated[
        bool, typer.Option("--quiet", "-q", help="Print nothing; only the exit code shows the result.")
    ] = False,
    color: options.Color = None,
) -> None:
    """Check specs. Exit code 0 if all of them can be deployed, else 1."""
    from swarmctl.views.findings.report import Report

    usual = finding_output.usual()
    chosen = options.format_of(form, json, usual)
    if diff:
        raise typer.Exit(exit_codes.ERROR if fixes.show_diffs(specs, unsafe=unsafe) else exit_codes.OK)
    if fix or unsafe:
        fixes.apply_fixes(specs, unsafe=unsafe, quiet=quiet)
    report = Report(tuple(map(checked, specs)), strict=strict)
    finding_output.show(report, chosen, output, quiet=quiet)
    for_people = not (json or quiet or form or output) and usual is finding_output.Format.HUMAN
    if for_people and len(specs) == 1:
        one = report.checked[0]
        if report.passed:
            next_command.advise("plan", specs[0])
        else:
            console.show_next(specs[0].fix_command(one.fixable, one.more_fixable), error=True)
    raise typer.Exit(exit_codes.OK if report.passed else exit_codes.ERROR)
