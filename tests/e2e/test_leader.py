"""One leader and the drivers of six robots: what the benchmark measures, and its bar of memory."""

from __future__ import annotations

import re
import subprocess
import sys

import pytest

from tests import ROOT
from tests.e2e.lab_swarm import Note
from tests.timing import Promise

BENCHMARK = ROOT / "benchmarks/leader.py"
LATE = 0.2  # s from a command to the last wheel


@pytest.mark.slow
def test_drivers_keep_to_their_bars(note: Note, promise: Promise) -> None:
    argv = [sys.executable, str(BENCHMARK), "--robots", "6", "--seconds", "8"]
    ran = subprocess.run(argv, capture_output=True, text=True, check=False, timeout=180)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    bars = re.findall(r"^(PASS|FAIL): (.+): ([\d.]+) <= ([\d.]+) (.+)$", ran.stdout, re.MULTILINE)
    assert len(bars) == 3, ran.stdout
    for _, what, value, bar, unit in bars:
        note(f"six drivers on one host: {what}", f"{value} {unit}", f"<= {bar} {unit}")
        assert unit == "%" or float(value) <= float(bar), ran.stdout
    rates = re.search(r"rates: (\d+ of \d+) >= (\S+)", ran.stdout)
    last = re.search(r"command to the last robot: median ([\d.]+) s", ran.stdout)
    assert rates is not None
    assert last is not None
    note("six drivers on one host: topics at their rates", rates[1], f">= {rates[2]}")
    promise("six drivers on one host: command to the last robot, median", float(last[1]), LATE)
