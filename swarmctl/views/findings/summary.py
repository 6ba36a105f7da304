"""Findings as the Markdown page that a job in GitHub Actions ends with."""

from __future__ import annotations

import re

from swarmctl.diagnostics import Diagnostic
from swarmctl.views.escape import printable
from swarmctl.views.findings.report import Checked, Report, outcome, place, sentence, ways_to_fix

MOST_SHOWN = 500  # GitHub refuses a summary of more than 1 MiB
_LONGEST = 300
_NAMES = re.compile("`([^`]*)`")
_MARKDOWN = str.maketrans({char: f"&#{ord(char)};" for char in "&<>|`*_[]()\\~!#@"})


def render(report: Report) -> str:
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
