"""On a terminal, no verb prints a line that is wider than it, or cuts one: tried on the fleet of 40 hosts."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import pytest
from rich.cells import cell_len

from swarmctl.cli import console
from swarmctl.cli.app import run
from tests import ROOT

SPEC = str(ROOT / "examples/lab-fleet/swarm.yaml")
VERBS = [
    f"validate {SPEC}",
    f"graph {SPEC}",
    f"graph {SPEC} --impact --paths --budgets",
    f"plan {SPEC} --offline",
    f"plan {SPEC} --offline --details --limit tb3-01",
    f"render {SPEC} --out out --limit p3-*",
    f"mode infer {SPEC}",
    "rules",
    "explain NET004",
    "driver list",
    "driver show mavros-px4",
    "driver show khepera3",
    "emulate --list",
]


class Terminal(io.StringIO):
    """A stream that is a terminal."""

    def isatty(self) -> bool:
        return True


@pytest.fixture
def terminal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Terminal:
    made = Terminal()
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    return made


@pytest.mark.parametrize("line", VERBS, ids=lambda line: line.replace(f" {SPEC}", ""))
def test_no_line_is_wider(line: str, terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    for width in (40, 60):
        monkeypatch.setenv("COLUMNS", str(width))
        monkeypatch.setattr(sys, "stdout", terminal)
        console._console.cache_clear()
        try:
            assert run(line.split()) == 0
        finally:
            console._console.cache_clear()
        shown = [one for one in terminal.getvalue().splitlines() if not one.startswith("next: swarmctl ")]
        assert shown
        terminal.truncate(0)
        terminal.seek(0)
        assert [one for one in shown if cell_len(one) > width] == []
        assert [one for one in shown if "…" in one] == []  # nothing is cut
