"""Every benchmark starts, also those that only the lab runs whole."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests import ROOT

BENCHMARKS = sorted((ROOT / "benchmarks").glob("*.py"))


@pytest.mark.parametrize("script", BENCHMARKS, ids=lambda script: script.stem)
def test_its_help_names_what_it_measures(script: Path) -> None:
    argv = [sys.executable, str(script), "--help"]
    ran = subprocess.run(
        argv, capture_output=True, text=True, check=False, timeout=120, stdin=subprocess.DEVNULL
    )
    assert ran.returncode == 0, ran.stderr
    assert f"usage: {script.name}" in ran.stdout
