"""Prints or writes the findings of ``validate`` in one of the output formats."""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING

from swarmctl.cli import console

if TYPE_CHECKING:
    from swarmctl.views.findings.report import Report


class Format(str, Enum):
    """The values of ``validate --format``."""

    HUMAN = "human"
    CONCISE = "concise"
    JSON = "json"
    GITHUB = "github"
    GITLAB = "gitlab"
    SARIF = "sarif"
    JUNIT = "junit"


_FOR_PEOPLE = (Format.HUMAN, Format.CONCISE)
_LINES = (Format.CONCISE, Format.GITHUB)  # formats that print nothing for a valid spec


def usual() -> Format:
    """The default format: that of GitHub Actions there, else the human one."""
    return Format.GITHUB if os.environ.get("GITHUB_ACTIONS") == "true" else Format.HUMAN


def show(report: Report, form: Format, output: Path | None, *, quiet: bool) -> None:
    """Print the findings, or write them to ``output``. ``quiet`` prints nothing at all."""
    from swarmctl.views.findings.report import outcome

    if form is Format.GITHUB:
        _summarize(report)
    if output is not None:
        _write(output, _text(report, form))
    elif form is Format.HUMAN and not quiet:
        _print_findings(report)
    elif not quiet:
        sys.stdout.buffer.write(_text(report, form).encode("utf-8", "backslashreplace"))
    if not quiet and (output is not None or form in _LINES):
        console.err().print(outcome(report))


def _print_findings(report: Report) -> None:
    """Print findings on stderr, and the summary of each valid spec on stdout."""
    from swarmctl.views.findings import human

    console.print_diagnostics(report.diagnostics)
    for one in report.checked:
        passes = report.passes(one)
        console.show(human.verdict(one, passes=passes), error=not passes)


def _text(report: Report, form: Format) -> str:
    from swarmctl.views.findings import human
    from swarmctl.views.findings.formats import FORMATS

    if form is Format.HUMAN:
        found = report.diagnostics
        verdicts = [human.verdict(one, passes=report.passes(one)) for one in report.checked]
        return "\n".join([human.findings(found, console.texts_of(found)).plain, *verdicts, ""]).lstrip("\n")
    if form is Format.SARIF:
        from swarmctl.rulebook import rulebook

        report = replace(report, rules=rulebook())
    return FORMATS[form.value](report if form in _FOR_PEOPLE else _relative(report))


def _relative(report: Report) -> Report:
    """The report with paths relative to the repository in CI, else to the current folder."""
    from swarmctl.views.findings.report import relative

    here = Path.cwd()
    tops = (os.environ.get(name) for name in ("GITHUB_WORKSPACE", "CI_PROJECT_DIR"))
    top = next((one for one in tops if one and here.is_relative_to(one)), str(here))
    return relative(report, str(here), os.path.normpath(top))


def _summarize(report: Report) -> None:
    """Append the job summary of GitHub Actions."""
    from swarmctl.views.findings import summary

    if file := os.environ.get("GITHUB_STEP_SUMMARY"):
        try:
            with Path(file).open("a", encoding="utf-8") as page:
                page.write(summary.render(_relative(report)))
        except OSError as error:
            console.err().print(f"warning: the job summary cannot be written: {error.strerror}")


def _write(output: Path, text: str) -> None:
    try:
        output.write_text(text, "utf-8", newline="\n")
    except OSError as error:
        console.fail(f"cannot write {output}: {error.strerror or error}", "choose another --output")
