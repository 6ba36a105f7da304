"""The table of a robot that was put to the test."""

from __future__ import annotations

from collections.abc import Sequence

from rich.text import Text

from swarmctl.conformance.results import Result, Verdict, passed
from swarmctl.views.text import printable

_WIDE = len("dead-man of the driver ")
_STYLE = {Verdict.OK: "green", Verdict.WARN: "bold yellow", Verdict.FAIL: "bold red"}


def line(result: Result) -> Text:
    """One check: how it went, the figure, and below it how to mend it."""
    head = f"{result.verdict.value:<5} {printable(result.check):<{_WIDE}}  "
    text = Text.assemble((head[:5], _STYLE[result.verdict]), head[5:], printable(result.figure))
    if result.mend:
        text.append("\n" + " " * len(head)).append(f"-> {printable(result.mend)}", "bold green")
    return text


def verdict(results: Sequence[Result]) -> str:
    count = {kind: sum(one.verdict is kind for one in results) for kind in Verdict}
    told = f"{count[Verdict.OK]} ok, {count[Verdict.WARN]} warnings, {count[Verdict.FAIL]} failed"
    return f"the robot is as its type says: {told}" if passed(results) else f"not as its type says: {told}"
