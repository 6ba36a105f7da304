"""One report that has everything: every severity, place, note and fix, and text that breaks formats."""

from __future__ import annotations

from swarmctl.diagnostics import Diagnostic, Edit, Fix, Note, Span
from swarmctl.rulebook import RuleText, Severity
from swarmctl.views.findings.report import Checked, Report
from tests import ROOT
from tests.loading import load_checked

SPEC, SHARED, QUIET = "lab day/swärm.yaml", "shared/hosts, old: 1.yaml", "arena.yaml"
LONG = "    key: " + "x" * 300 + " # the end"

TEXTS = {
    # CRLF, wide letters, an emoji, a line of more than 300 characters, a control and a bidi character
    SPEC: "\r\n".join(
        [
            "version: 1",
            "name: 実験室 🤖 lab",
            "hosts:",
            "  pi-1: {address: 10.0.0.1}",
            "  pi-2: {address: 10.0.0.1}",
            LONG,
            "robots: \x1b[31m \u202e",
            "",
        ]
    ),
    SHARED: "hosts:\n  pi-1: {address: 10.0.0.1}\n",
}


def at(file: str, line: int, column: int, end: int) -> Span:
    return Span(file, line, column, line, end)


FINDINGS = (
    Diagnostic("FILE001", f"there is no file `{SPEC}.lock`", help=("did you mean `swarm.lock`?",)),
    Diagnostic("NAME001", "100% of `lab` is not a name", at(SPEC, 2, 11, 16), label="`🤖 lab`: two words"),
    Diagnostic(
        "ID001", "two hosts have the address `10.0.0.1`", at(SPEC, 5, 19, 27), label="also of `pi-2`",
        notes=(
            Note(at(SPEC, 4, 19, 27), "first of `pi-1`"),
            Note(at(SHARED, 2, 19, 27), "and of `pi-1` here"),
        ),
        help=("give `pi-2` an address of its own", "or leave it out"),
        fix=Fix("give `pi-2` the next address", (
            Edit(at(SPEC, 5, 19, 27), "10.0.0.2"), Edit(at(SHARED, 2, 1, 1), "# checked\n")), safe=False),
    ),
    Diagnostic("ID001", "two hosts have the address `10.0.0.1`", at(SPEC, 4, 19, 27)),
    Diagnostic(
        "SET001", "nobody reads <this> & \"that\" | it is long", at(SPEC, 6, 305, 310),
        "the end",
    ),
    Diagnostic(
        "YAML001", "unfit: \x1b[31m \u202e,\r\n::error::x ]]> \ufffe", Span(SPEC, 3, 1, 7, 9),
        label="from here",
    ),
)  # fmt: skip
WARNING = Diagnostic("SET001", "`rates` are never reached", at(QUIET, 1, 1, 8))


RULES = {
    "ID001": RuleText(
        "ID001", "Identity", Severity.ERROR,
        what="No two hosts share an address",
        why="Both would answer, now one and now the other.",
        threads=(), manuals=(), own=True,
        fix="Give each its own.",
        fails=None, passes=None, shown="", firm=False,
    )
}  # fmt: skip


def report(*, strict: bool = False) -> Report:
    """A spec that is wrong, one that is right but for a warning, and one that is right."""
    example = ROOT / "examples/paper-leader/swarm.yaml"
    document, _ = load_checked(example)
    checked = (
        Checked(SPEC, None, FINDINGS, fixable=3, more_fixable=1),
        Checked(QUIET, document, (WARNING,)),
        Checked("right.yaml", document),
    )
    return Report(checked, strict=strict, rules=RULES)
