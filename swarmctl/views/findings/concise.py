"""Findings as lines that editors and ``grep`` parse: ``file:line:column: error[CODE] message``."""

from __future__ import annotations

from swarmctl.views.escape import printable
from swarmctl.views.findings.report import Report, place


def render(report: Report) -> str:
    """Returns the findings as one line for each finding."""
    return "".join(
        f"{printable(place(one, found))}: {found.severity.value}[{found.code}] {printable(found.message)}\n"
        for one, found in report.findings
    )
