"""A check of ``swarmctl doctor`` as lines: what it found, and the remedy."""

from __future__ import annotations

from rich.text import Text

from swarmctl.health.first_aid import Check
from swarmctl.views.escape import printable
from swarmctl.views.status import GLYPH, STYLE


def lines(check: Check) -> Text:
    """``✗ port: k3-pi is up, but nothing listens for SSH there``, and below it ``help: ...``."""
    verdict = check.verdict
    text = Text.assemble(
        (GLYPH[verdict.state], STYLE[verdict.state]), f" {check.name}: {printable(verdict.message)}"
    )
    if verdict.hint:
        text.append("\n").append("    help", "bold green").append(f": {printable(verdict.hint)}")
    return text
