"""Prints or writes the findings of ``validate``, and the fixes of a spec."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from dataclasses import replace
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING

from swarmctl.cli import console, file_writes
from swarmctl.cli.file_writes import Change
from swarmctl.cli.spec_fixes import SpecFixes

if TYPE_CHECKING:
    from swarmctl.cli.spec_args import SpecFiles
    from swarmctl.linter.fixes import Fixable, Fixed
    from swarmctl.views.findings.report import Report


def apply_fixes(specs: Iterable[SpecFiles], *, unsafe: bool, quiet: bool) -> None:
    """Write the files of specs with all fixes that can be applied, and print each fix."""
    from swarmctl.views.escape import printable

    for spec in specs:
        fixable, changes = _changes(spec, unsafe=unsafe)
        file_writes.write(changes)
        for found in _chosen(fixable, unsafe=unsafe).made if not quiet else ():
            title = found.fix.title if found.fix else ""
            console.err().print(printable(f"fixed {found.code} {found.span}: {title}"))


def show_diffs(specs: Iterable[SpecFiles], *, unsafe: bool) -> bool:
    """Print the changes that ``--fix`` would make; True if there are any."""
    from swarmctl.views.escape import printable

    some = False
    for spec in specs:
        fixable, changes = _changes(spec, unsafe=unsafe)
        for change in changes:
            sys.stdout.write(file_writes.difference(change))
        if not changes and fixable.all.made:
            console.err().print(printable(f"{spec}: no safe fix; `--unsafe-fixes --diff` shows the guesses"))
        some = some or bool(changes)
    return some


def _chosen(fixable: Fixable, *, unsafe: bool) -> Fixed:
    return fixable.all if unsafe else fixable.safe


def _changes(spec: SpecFiles, *, unsafe: bool) -> tuple[Fixable, list[Change]]:
    """The fixes and the changes to the files."""
    files = SpecFixes(spec)
    fixable = files.fixable()
    texts = _chosen(fixable, unsafe=unsafe).texts
    changes = [
        Change(files.read(Path(file)), file, files.original(file), text) for file, text in texts.items()
    ]
    return fixable, [change for change in changes if change.before != change.after]


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
    from swarmctl.views.findings import formats

    if file := os.environ.get("GITHUB_STEP_SUMMARY"):
        try:
            with Path(file).open("a", encoding="utf-8") as page:
                page.write(formats.summary(_relative(report)))
        except OSError as error:
            console.err().print(f"warning: the job summary cannot be written: {error.strerror}")


def _write(output: Path, text: str) -> None:
    try:
        output.write_text(text, "utf-8", newline="\n")
    except OSError as error:
        console.fail(f"cannot write {output}: {error.strerror or error}", "choose another --output")
