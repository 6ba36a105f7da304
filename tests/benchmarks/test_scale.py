"""The benchmark of large fleets runs, and workers take most of a host's cost from the operator."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys

import pytest

from tests import ROOT

BENCHMARK = ROOT / "benchmarks/scale.py"


@pytest.mark.skipif(not importlib.util.find_spec("distributed"), reason="needs swarmctl[scale]")
def test_workers_take_most_of_the_cost_of_hosts() -> None:
    argv = [sys.executable, str(BENCHMARK), "--hosts", "40", "--workers", "1"]
    ran = subprocess.run(argv, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "plan of 40 recorded hosts" in ran.stdout
    found = re.search(r"CPU time per host is ([0-9.]+) times less", ran.stdout)
    assert found is not None, ran.stdout + ran.stderr
    assert float(found[1]) > 1, ran.stdout  # the bar is for 2 000 hosts on a quiet machine
