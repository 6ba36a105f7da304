"""The benchmark of ``validate`` runs, its specs have no fault, and its bars hold for small swarms."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

BENCHMARK = Path(__file__).parents[2] / "benchmarks/validate.py"


def test_small_swarms_pass_the_bars() -> None:
    ran = subprocess.run(
        [sys.executable, str(BENCHMARK), "--quick", "--runs", "3"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    *table, verdict = ran.stdout.splitlines()
    assert verdict.startswith("PASS: ratio ")
    modes = {line.split()[0] for line in table[1:]}
    assert {"single-minded", "leader", "central", "standalone", "combined"} <= modes
