"""One leader and the drivers of six robots: the benchmark runs, and keeps its bars."""

from __future__ import annotations

import re
import subprocess
import sys

from tests import ROOT
from tests.e2e.lab_swarm import Note
from tests.timing import CPU_MARGIN

BENCHMARK = ROOT / "benchmarks/leader.py"
LATE = 0.2  # s from a command to the last wheel


def test_drivers_keep_to_their_bars(note: Note) -> None:
    argv = [sys.executable, str(BENCHMARK), "--robots", "6", "--seconds", "8"]
    ran = subprocess.run(argv, capture_output=True, text=True, check=False, timeout=180)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    bars = re.findall(r"^(PASS|FAIL): (.+): ([\d.]+) <= ([\d.]+) (.+)$", ran.stdout, re.MULTILINE)
    assert len(bars) == 3, ran.stdout
    for _, what, value, bar, unit in bars:
        most = float(bar) * (CPU_MARGIN if unit == "%" else 1.0)
        note(f"six drivers on one host: {what}", f"{value} {unit}", f"<= {most:g} {unit}")
        assert float(value) <= most, ran.stdout
    assert "PASS: rates" in ran.stdout, ran.stdout
    late = re.search(r"command to the last robot: median ([\d.]+) s", ran.stdout)
    assert late is not None
    assert float(late[1]) <= LATE, ran.stdout
