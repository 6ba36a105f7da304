"""Every format, over findings that have everything: its golden file, its published schema, hostile text."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from urllib.parse import unquote

import jsonschema
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

from swarmctl.diagnostics import (
    Diagnostic,
    Edit,
    Fix,
    Note,
    Span,
)
from swarmctl.views.escape import printable
from swarmctl.views.findings import formats, junit, sarif
from swarmctl.views.findings import formats as json_format
from swarmctl.views.findings.formats import FORMATS
from swarmctl.views.findings.report import Checked, Report, fingerprints, relative
from tests.views import sample_findings as sample

HERE = Path(__file__).parent
SARIF = jsonschema.Draft4Validator(json.loads((HERE / "schemas/sarif-schema-2.1.0.json").read_text("utf-8")))
JUNIT = etree.XMLSchema(file=str(HERE / "schemas/junit-10.xsd"))
ENDING = {"concise": "txt", "github": "txt", "junit": "xml"}

texts = st.text(max_size=20) | st.sampled_from(
    ["a\r\n::error::b", "%0A", "]]>", "&amp;", "\x1b[2J", "\u202e", "\ufffe\udc80", "|`*", "a, b: c", "\x85"]
)
lines = st.integers(min_value=1, max_value=9)


@st.composite
def spans(draw: st.DrawFn) -> Span:
    line, column = draw(lines), draw(lines)
    ends = draw(st.tuples(lines, lines))
    end = max((line, column), ends)
    return Span(draw(texts), line, column, *end)


fixes = st.builds(Fix, texts, st.lists(st.builds(Edit, spans(), texts), min_size=1, max_size=3).map(tuple))
diagnostics = st.builds(
    Diagnostic,
    code=st.sampled_from(["NET001", "YAML002", "NET004"]),
    message=texts,
    span=spans() | st.none(),
    label=texts,
    notes=st.lists(st.builds(Note, spans(), texts), max_size=2).map(tuple),
    help=st.lists(texts, max_size=2).map(tuple),
    fix=fixes | st.none(),
)
reports = st.builds(
    Report,
    st.lists(
        st.builds(Checked, texts, st.none(), st.lists(diagnostics, min_size=1, max_size=3).map(tuple)),
        max_size=2,
    ).map(tuple),
    strict=st.booleans(),
)


@pytest.mark.parametrize("name", FORMATS)
def test_it_stays_as_it_is(name: str, golden: Callable[[Path, str], None]) -> None:
    golden(HERE / f"golden/{name}.{ENDING.get(name, 'json')}", FORMATS[name](sample.report()))


def test_the_page_of_a_job_stays_as_it_is(golden: Callable[[Path, str], None]) -> None:
    golden(HERE / "golden/summary.md", formats.summary(sample.report()))


@pytest.mark.parametrize("name", FORMATS)
def test_nothing_found_is_a_whole_document_as_well(name: str) -> None:
    right = Report(sample.report().checked[2:])
    text = FORMATS[name](right)
    if name in ("json", "gitlab", "sarif"):
        json.loads(text)
    elif name == "junit":
        assert etree.fromstring(text.encode()).get("tests") == "1"
    else:
        assert text == ""


# ---------------------------------------------------------------------------- concise


@given(reports)
def test_a_concise_finding_is_one_line_that_hides_nothing(report: Report) -> None:
    rows = formats.concise(report).splitlines()
    assert len(rows) == len(report.diagnostics)
    for row, (one, found) in zip(rows, report.findings, strict=True):
        assert row == printable(row)
        assert row.startswith(printable(found.span.file if found.span else one.spec))
        assert row.endswith(f"{found.severity.value}[{found.code}] {printable(found.message)}")


# ---------------------------------------------------------------------------- json


@given(reports)
def test_json_carries_every_text_as_it_is(report: Report) -> None:
    parsed = json.loads(json_format.json_document(report))
    assert [one["message"] for one in parsed["diagnostics"]] == [one.message for one in report.diagnostics]
    assert parsed["valid"] is report.passed


# ---------------------------------------------------------------------------- sarif


@given(reports)
def test_sarif_follows_its_schema(report: Report) -> None:
    SARIF.validate(json.loads(sarif.render(report)))


def test_the_sample_follows_the_schema_of_sarif() -> None:
    SARIF.validate(json.loads(sarif.render(sample.report())))


def test_sarif_names_files_by_relative_uris() -> None:
    (run,) = json.loads(sarif.render(sample.report()))["runs"]
    place = run["results"][1]["locations"][0]["physicalLocation"]
    assert place["artifactLocation"]["uri"] == "lab%20day/sw%C3%A4rm.yaml"
    assert unquote(sarif.uri(sample.SHARED)) == sample.SHARED
    assert ":" not in sarif.uri(sample.SHARED)  # the first part would be a scheme
    assert sarif.uri("/a b") == "file:///a%20b"


def test_a_fix_in_sarif_makes_the_change() -> None:
    """The replacements of a fix, carried out on the text by a reader of SARIF."""
    (run,) = json.loads(sarif.render(sample.report()))["runs"]
    (fix,) = next(one["fixes"] for one in run["results"] if "fixes" in one)
    change = next(
        one for one in fix["artifactChanges"] if unquote(one["artifactLocation"]["uri"]) == sample.SPEC
    )
    rows = sample.TEXTS[sample.SPEC].split("\r\n")
    for one in change["replacements"]:
        region = one["deletedRegion"]
        row = rows[region["startLine"] - 1]
        rows[region["startLine"] - 1] = (
            row[: region["startColumn"] - 1] + one["insertedContent"]["text"] + row[region["endColumn"] - 1 :]
        )
    assert rows[4] == "  pi-2: {address: 10.0.0.2}"


# ---------------------------------------------------------------------------- gitlab


@given(reports)
def test_gitlab_gets_what_it_asks_for(report: Report) -> None:
    issues = json.loads(formats.gitlab(report))
    assert len(issues) == len(report.diagnostics)
    assert len({one["fingerprint"] for one in issues}) == len(issues)
    for one in issues:
        assert one["severity"] in ("info", "minor", "major", "critical", "blocker")
        assert one["location"]["lines"]["begin"] >= 1
        assert isinstance(one["description"], str)
        assert isinstance(one["check_name"], str)


def test_a_fingerprint_stays_when_lines_move() -> None:
    def below(found: Diagnostic) -> Diagnostic:
        span = found.span and replace(found.span, line=found.span.line + 7, end_line=found.span.end_line + 7)
        return replace(found, span=span)

    first, *others = sample.report().checked
    moved = Report((replace(first, diagnostics=tuple(map(below, first.diagnostics))), *others))
    assert fingerprints(moved) == fingerprints(sample.report())


# ---------------------------------------------------------------------------- github


def decoded(command: str) -> tuple[dict[str, str], str]:
    """A workflow command as the runner reads it."""
    matched = re.fullmatch(r"::(?:error|warning) ([^\r\n]*?)::([^\r\n]*)", command)
    assert matched, command
    codes = {"%3A": ":", "%2C": ",", "%0A": "\n", "%0D": "\r", "%25": "%"}

    def plain(text: str) -> str:
        return re.sub("%(3A|2C|0A|0D|25)", lambda code: codes[code[0]], text)

    properties = dict(one.split("=", 1) for one in matched[1].split(","))
    return {name: plain(value) for name, value in properties.items()}, plain(matched[2])


@given(reports)
def test_a_github_command_is_one_line_with_all_details(report: Report) -> None:
    commands = formats.github(report).splitlines()
    assert len(commands) == len(report.diagnostics)
    for command, (one, found) in zip(commands, report.findings, strict=True):
        properties, message = decoded(command)
        assert properties["file"] == printable(found.span.file if found.span else one.spec)
        assert printable(found.message) in message
        title = found.fix.title if found.fix else None
        assert all(f"\nhelp: {printable(line)}" in message for line in found.help if line != title)
        assert title is None or f"fix: {printable(title)}" in message


def test_github_gets_columns_only_on_one_line() -> None:
    found = [decoded(line)[0] for line in formats.github(sample.report()).splitlines()]
    assert [("col" in one, "line" in one) for one in found[:3]] == [
        (False, False),
        (True, True),
        (True, True),
    ]
    assert ("col" in found[5], found[5]["line"], found[5]["endLine"]) == (False, "3", "7")


@given(reports)
def test_no_text_is_taken_for_markdown(report: Report) -> None:
    page = formats.summary(report)
    rows = [line for line in page.split("\n") if line.startswith("| ")][1:]
    assert len(rows) == len(report.diagnostics)
    for row in rows:
        assert row.count("|") == 6
        assert not re.search(r"[`*_\[\]\\~@]|<(?!/?code>)", row)


# ---------------------------------------------------------------------------- junit


@given(reports)
def test_junit_follows_its_schema(report: Report) -> None:
    root = etree.fromstring(junit.render(report).encode("utf-8"))
    JUNIT.assertValid(root)
    text = "".join(root.itertext())
    assert all(printable(found.message) in text for found in report.diagnostics)


def test_junit_counts_the_fixes_of_each_spec() -> None:
    suites = etree.fromstring(junit.render(sample.report()).encode("utf-8"))
    counts = [[one.get("value") for one in suite.iter("property")] for suite in suites]
    assert counts == [["3", "1"], ["0", "0"], ["0", "0"]]


@given(reports)
def test_gitlab_names_every_way_to_fix(report: Report) -> None:
    for one, found in zip(json.loads(formats.gitlab(report)), report.diagnostics, strict=True):
        ways = (*found.help, *([found.fix.title] if found.fix else ()))
        assert all(way in one["description"] for way in ways)


def test_the_sample_follows_the_schema_of_junit() -> None:
    JUNIT.assertValid(etree.fromstring(junit.render(sample.report()).encode("utf-8")))


def test_a_warning_is_a_failed_test_only_when_it_must_not_be() -> None:
    def failed(strict: bool) -> list[str | None]:
        root = etree.fromstring(junit.render(sample.report(strict=strict)).encode("utf-8"))
        return [suite.get("failures") for suite in root]

    assert failed(strict=False) == ["4", "0", "0"]
    assert failed(strict=True) == ["5", "1", "0"]


# ---------------------------------------------------------------------------- paths


@pytest.mark.parametrize(
    ("given", "base", "shown"),
    [
        ("swarm.yaml", "/repo/lab", "swarm.yaml"),
        ("./x/../swarm.yaml", "/repo/lab", "swarm.yaml"),
        ("/repo/lab/swarm.yaml", "/repo/lab", "swarm.yaml"),
        ("swarm.yaml", "/repo", "lab/swarm.yaml"),
        ("../other.yaml", "/repo", "other.yaml"),
        ("../other.yaml", "/repo/lab", "/repo/other.yaml"),
        ("/repository/a.yaml", "/repo", "/repository/a.yaml"),
        ("/dev/stdin", "/repo/lab", "/dev/stdin"),
    ],
)
def test_paths_are_relative_below_the_base(given: str, base: str, shown: str) -> None:
    span = Span(given, 1, 1, 1, 2)
    found = Diagnostic(
        "YAML001", "m", span, notes=(Note(span, "n"),), fix=Fix("f", (Edit(span, "t"),), safe=True)
    )
    moved = relative(Report((Checked(given, None, (found,)),)), "/repo/lab", base)
    (one,) = moved.checked
    (there,) = one.diagnostics
    assert there.fix is not None
    assert {
        one.spec,
        there.span and there.span.file,
        there.notes[0].span.file,
        there.fix.edits[0].span.file,
    } == {shown}
