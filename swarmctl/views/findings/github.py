"""Findings as workflow commands of GitHub Actions, which stand as annotations in the changed lines.

https://docs.github.com/actions/reference/workflow-commands-for-github-actions
"""

from __future__ import annotations

from collections.abc import Mapping

from swarmctl.diagnostics import Diagnostic, Span
from swarmctl.views.escape import printable
from swarmctl.views.findings.report import Checked, Report, file_of, more, place, sentence

_DATA = str.maketrans({"%": "%25", "\r": "%0D", "\n": "%0A"})
_PROPERTY = _DATA | str.maketrans({":": "%3A", ",": "%2C"})


def render(report: Report) -> str:
    """Returns the findings as workflow commands of GitHub Actions."""
    return "".join(f"{_command(one, found)}\n" for one, found in report.findings)


def _command(one: Checked, found: Diagnostic) -> str:
    given: dict[str, object] = {"title": found.code, "file": file_of(one, found)}
    if found.span:
        given |= _region(found.span)
    properties = ",".join(
        f"{name}={printable(str(value)).translate(_PROPERTY)}" for name, value in given.items()
    )
    # the log of a run shows the message alone, so the place stands in it as well
    lines = (f"{place(one, found)}: {sentence(found)}", *more(found))
    message = "\n".join(map(printable, lines)).translate(_DATA)
    return f"::{found.severity.value} {properties}::{message}"


def _region(span: Span) -> Mapping[str, int]:
    """Columns count only where the annotation stands on one line."""
    columns = {"col": span.column, "endColumn": span.end_column} if span.line == span.end_line else {}
    return {"line": span.line, "endLine": span.end_line} | columns
