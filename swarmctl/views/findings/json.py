"""Findings as one JSON document, the form that docs/checking.md promises to programs."""

from __future__ import annotations

import json

from swarmctl.views.findings.report import Report


def render(report: Report) -> str:
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
