"""Findings as JUnit XML: a suite a spec, in it one test case for each file and rule that has findings.

The dialect is Jenkins' own schema, junit-10.xsd, which GitLab and the others read as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from swarmctl.diagnostics import Diagnostic
from swarmctl.views.escape import printable
from swarmctl.views.findings.report import Checked, Report, file_of, more, place, sentence

_NAME = "swarmctl validate"


def render(report: Report) -> str:
    """Returns the findings as JUnit XML."""
    root = Element("testsuites", {"name": _NAME})
    for one in report.checked:
        _suite(root, report, one)
    return written(root)


def written(root: Element) -> str:
    """Returns the text of a document, with its numbers of tests."""
    for suite in (root, *root.iter("testsuite")):
        suite.attrib |= _counts(suite)
    indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{tostring(root, encoding="unicode")}\n'


def _suite(root: Element, report: Report, one: Checked) -> None:
    suite = SubElement(root, "testsuite", {"name": printable(one.spec)})
    properties = SubElement(suite, "properties")
    for name, count in (("fixable", one.fixable), ("moreFixable", one.more_fixable)):
        SubElement(properties, "property", {"name": name, "value": str(count)})
    cases: dict[tuple[str, str], list[Diagnostic]] = {}
    for found in one.diagnostics:
        cases.setdefault((file_of(one, found), found.code), []).append(found)
    if not cases:
        SubElement(suite, "testcase", {"classname": printable(one.spec), "name": "valid"})
    for (file, code), together in cases.items():
        case = SubElement(suite, "testcase", {"classname": printable(file), "name": code})
        _findings(case, report, one, together)


def _findings(case: Element, report: Report, one: Checked, found: Sequence[Diagnostic]) -> None:
    """What fails is the test's failure; a warning is what a passing test prints."""
    failing = [each for each in found if report.fails(each)]
    if failing:
        also = f" (and {len(failing) - 1} more)" if len(failing) > 1 else ""
        message = printable(sentence(failing[0])) + also
        failure = SubElement(case, "failure", {"type": failing[0].severity.value, "message": message})
        failure.text = _text(one, failing)
    if warnings := [each for each in found if not report.fails(each)]:
        SubElement(case, "system-out").text = _text(one, warnings)


def _text(one: Checked, found: Sequence[Diagnostic]) -> str:
    """Every finding in full, without the characters that XML does not allow."""
    lines = (
        printable(line) for each in found for line in (f"{place(one, each)}: {sentence(each)}", *more(each))
    )
    return "\n".join(lines)


def _counts(element: Element) -> dict[str, str]:
    tests, failures = (sum(1 for _ in element.iter(name)) for name in ("testcase", "failure"))
    return {"tests": str(tests), "failures": str(failures), "errors": "0"}
