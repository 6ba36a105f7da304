"""The benchmark of ``validate`` runs, its specs have no fault, and small swarms keep the bars."""

from __future__ import annotations

import re
import subprocess
import sys

import pytest

from tests import ROOT
from tests.timing import MARGIN

BENCHMARK = ROOT / "benchmarks/validate.py"


@pytest.mark.slow
def test_small_swarms_keep_the_bars() -> None:
    ran = subprocess.run(
        [sys.executable, str(BENCHMARK), "--quick", "--runs", "2"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode in (0, 1), ran.stdout + ran.stderr
    *table, verdict = ran.stdout.splitlines()
    found = re.match(r"(PASS|FAIL): .*ratio ([0-9.]+) .*memory ([0-9]+) MB", verdict)
    assert found is not None, ran.stdout + ran.stderr
    assert float(found[2]) <= MARGIN * 3, verdict
    assert int(found[3]) <= 400, verdict
    modes = {line.split()[0] for line in table[1:]}
    assert {"single-minded", "leader", "central", "standalone", "combined"} <= modes
