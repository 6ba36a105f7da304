"""Findings as SARIF 2.1.0, for code scanning and for viewers in editors.

https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/sarif-v2.1.0-errata01-os-complete.html
"""

from __future__ import annotations

import json
from itertools import groupby
from typing import Any
from urllib.parse import quote

from swarmctl.diagnostics import Diagnostic, Fix, Note, Span
from swarmctl.rulebook import RuleText
from swarmctl.version import __version__
from swarmctl.views.findings.report import Checked, Report, fingerprints, more, sentence

SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
_LINE_ENDS = ["\r\n", "\n", "\r", "\u0085", "\u2028", "\u2029"]  # YAML's


def render(report: Report) -> str:
    """Returns the findings as SARIF 2.1.0."""
    codes = sorted({found.code for found in report.diagnostics})
    driver = {
        "name": "swarmctl",
        "semanticVersion": __version__,
        "rules": [_rule(code, report.rules.get(code)) for code in codes],
    }
    results = [
        _result(one, found, codes.index(found.code), name)
        for (one, found), name in zip(report.findings, fingerprints(report), strict=True)
    ]
    run = {
        "tool": {"driver": driver},
        "columnKind": "unicodeCodePoints",
        "newlineSequences": _LINE_ENDS,
        "results": results,
        "properties": {
            "fixable": sum(one.fixable for one in report.checked),
            "moreFixable": sum(one.more_fixable for one in report.checked),
        },
    }
    return json.dumps({"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}, indent=2) + "\n"


def _rule(code: str, text: RuleText | None) -> dict[str, Any]:
    if text is None:
        return {"id": code}
    return {
        "id": code,
        "shortDescription": {"text": text.what},
        "fullDescription": {"text": text.why},
        "help": {"text": text.fix},
        "defaultConfiguration": {"level": text.severity.value},
        "properties": {"tags": [text.family]},
    }


def _result(one: Checked, found: Diagnostic, rule: int, name: str) -> dict[str, Any]:
    result: dict[str, Any] = {
        "ruleId": found.code,
        "ruleIndex": rule,
        "level": found.severity.value,
        "message": {"text": "\n".join((sentence(found), *more(found)))},
        "locations": [{"physicalLocation": _place(found.span) if found.span else _start(one.spec)}],
        "partialFingerprints": {"swarmctlFinding/v1": name},
    }
    if found.notes:
        result["relatedLocations"] = [_related(number, note) for number, note in enumerate(found.notes)]
    if found.fix:
        result["fixes"] = [_fix(found.fix)]
    return result


def _related(number: int, note: Note) -> dict[str, Any]:
    return {"id": number, "physicalLocation": _place(note.span), "message": {"text": note.text}}


def _fix(fix: Fix) -> dict[str, Any]:
    in_order = sorted(fix.edits, key=lambda edit: edit.span)
    return {
        "description": {"text": fix.title},
        "properties": {"applicability": "safe" if fix.safe else "unsafe"},
        "artifactChanges": [
            {
                "artifactLocation": {"uri": uri(file)},
                "replacements": [
                    {"deletedRegion": _region(edit.span), "insertedContent": {"text": edit.text}}
                    for edit in edits
                ],
            }
            for file, edits in groupby(in_order, key=lambda edit: edit.span.file)
        ],
    }


def _place(span: Span) -> dict[str, Any]:
    return {"artifactLocation": {"uri": uri(span.file)}, "region": _region(span)}


def _start(file: str) -> dict[str, Any]:
    """Code scanning drops a result that has no line."""
    return {"artifactLocation": {"uri": uri(file)}, "region": {"startLine": 1}}


def _region(span: Span) -> dict[str, int]:
    """Lines and columns count from 1 and the end is exclusive, in SARIF as here."""
    return {
        "startLine": span.line,
        "startColumn": span.column,
        "endLine": span.end_line,
        "endColumn": span.end_column,
    }


def uri(file: str) -> str:
    """A path as a URI reference, relative where the path is. Names that are no UTF-8 keep their bytes."""
    path = quote(file.encode("utf-8", "surrogateescape"))
    return f"file://{path}" if file.startswith("/") else path
