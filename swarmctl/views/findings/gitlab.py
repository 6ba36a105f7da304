"""Findings as a GitLab Code Quality report, shown in a merge request.

https://docs.gitlab.com/ci/testing/code_quality/#code-quality-report-format
"""

from __future__ import annotations

import json

from swarmctl.diagnostics import Diagnostic
from swarmctl.rulebook import Severity
from swarmctl.views.findings.report import Report, file_of, fingerprints, sentence, ways_to_fix

_SEVERITY = {Severity.ERROR: "critical", Severity.WARNING: "minor"}


def render(report: Report) -> str:
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
