"""The results of ``driver test`` as text."""

from __future__ import annotations

from collections.abc import Sequence

from rich.text import Text

from swarmctl.conformance.results import Result, Verdict, passed
from swarmctl.views.escape import printable

MOST_BYTES = 24  # shown of what was received
_WIDE = len("dead-man of the driver ")
_STYLE = {Verdict.OK: "green", Verdict.WARN: "bold yellow", Verdict.FAIL: "bold red"}


def line(result: Result) -> Text:
    """One check: the verdict, the figure, and below it how to fix it."""
    head = f"{result.verdict.value:<5} {printable(result.check):<{_WIDE}}  "
    text = Text.assemble((head[:5], _STYLE[result.verdict]), head[5:], printable(result.figure))
    if result.received is not None:
        text.append("\n" + " " * len(head)).append(f"received {_bytes(result.received)}", "dim")
    if result.fix:
        text.append("\n" + " " * len(head)).append(f"-> {printable(result.fix)}", "bold green")
    return text


def _bytes(data: bytes) -> str:
    """The last bytes in hexadecimal digits, and as text if they may be text."""
    if not data:
        return "nothing"
    last = data[-MOST_BYTES:]
    text = ascii(last.decode("latin-1"))
    return f"{'... ' if len(data) > len(last) else ''}{last.hex(' ')}  {text}"


def verdict(results: Sequence[Result]) -> str:
    """The summary of all checks."""
    count = {kind: sum(one.verdict is kind for one in results) for kind in Verdict}
    counts = f"{count[Verdict.OK]} ok, {count[Verdict.WARN]} warnings, {count[Verdict.FAIL]} failed"
    return (
        f"the robot matches its type: {counts}"
        if passed(results)
        else f"the robot does not match its type: {counts}"
    )
