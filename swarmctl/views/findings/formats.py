"""The formats for programs, by their ``--format`` name.

https://docs.github.com/actions/reference/workflow-commands-for-github-actions

https://docs.gitlab.com/ci/testing/code_quality/#code-quality-report-format
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping

from swarmctl.diagnostics import Diagnostic, Span
from swarmctl.rulebook import Severity
from swarmctl.views.escape import printable
from swarmctl.views.findings import junit, sarif
from swarmctl.views.findings.report import (
    Checked,
    Report,
    file_of,
    fingerprints,
    more,
    outcome,
    place,
    sentence,
    ways_to_fix,
)


def concise(report: Report) -> str:
    """Returns the findings as one line for each finding."""
    return "".join(
        f"{printable(place(one, found))}: {found.severity.value}[{found.code}] {printable(found.message)}\n"
        for one, found in report.findings
    )


def json_document(report: Report) -> str:
    """Returns the findings as one JSON document."""
    document = {
        "v": 1,
        "valid": report.passed,
        "specs": [
            {
                "spec": one.spec,
                "swarm": one.document.spec.name if one.document else None,
                "valid": report.passes(one),
                "fixable": one.fixable,
                "more_fixable": one.more_fixable,
            }
            for one in report.checked
        ],
        "diagnostics": [{"spec": one.spec} | found.to_json() for one, found in report.findings],
    }
    return json.dumps(document, indent=2) + "\n"


_DATA = str.maketrans({"%": "%25", "\r": "%0D", "\n": "%0A"})
_PROPERTY = _DATA | str.maketrans({":": "%3A", ",": "%2C"})


def github(report: Report) -> str:
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


_SEVERITY = {Severity.ERROR: "critical", Severity.WARNING: "minor"}


def gitlab(report: Report) -> str:
    """Returns the findings as a Code Quality report of GitLab."""
    issues = [
        {
            "check_name": found.code,
            "description": _description(found),
            "severity": _SEVERITY[found.severity],
            "fingerprint": name,
            "location": {
                "path": file_of(one, found),
                "lines": {"begin": found.span.line, "end": found.span.end_line}
                if found.span
                else {"begin": 1},
            },
        }
        for (one, found), name in zip(report.findings, fingerprints(report), strict=True)
    ]
    return json.dumps(issues, indent=2) + "\n"


def _description(found: Diagnostic) -> str:
    """One line, the only one that a merge request shows."""
    ways = ways_to_fix(found)
    return f"{sentence(found)} ({ways})" if ways else sentence(found)


MOST_SHOWN = 500  # GitHub refuses a summary of more than 1 MiB
_LONGEST = 300
_NAMES = re.compile("`([^`]*)`")
_MARKDOWN = str.maketrans({char: f"&#{ord(char)};" for char in "&<>|`*_[]()\\~!#@"})


def summary(report: Report) -> str:
    """A table of the findings; no text in it can be taken for Markdown or HTML."""
    lines = [f"### swarmctl validate: {outcome(report)}", ""]
    found = list(report.findings)
    if found:
        lines += ["| | where | rule | what | help |", "|---|---|---|---|---|"]
        lines += [_row(*each) for each in found[:MOST_SHOWN]]
    if len(found) > MOST_SHOWN:
        lines += ["", f"... and {len(found) - MOST_SHOWN} more"]
    return "\n".join([*lines, ""])


def _row(one: Checked, found: Diagnostic) -> str:
    cells = (found.severity.value, place(one, found), found.code, sentence(found), ways_to_fix(found))
    return f"| {' | '.join(map(_cell, cells))} |"


def _cell(text: str) -> str:
    """Returns ``text`` as a Markdown table cell; text in backticks becomes code."""
    shown = printable(text)
    if len(shown) > _LONGEST:
        shown = f"{shown[:_LONGEST]}..."
    parts = _NAMES.split(shown)
    return "".join(
        f"<code>{part.translate(_MARKDOWN)}</code>" if number % 2 else part.translate(_MARKDOWN)
        for number, part in enumerate(parts)
    )


FORMATS: Mapping[str, Callable[[Report], str]] = {
    "concise": concise,
    "json": json_document,
    "github": github,
    "gitlab": gitlab,
    "sarif": sarif.render,
    "junit": junit.render,
}
