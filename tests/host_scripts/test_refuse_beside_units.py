"""``refuse-beside-units``: a launch file starts no nodes beside the units that have them."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from swarmctl.resources import templates
from tests.timing import PATIENCE

PROGRAM = templates() / "ros1/refuse-beside-units"
STATES = {
    "runs": ("active", "running"),
    "waits": ("activating", "auto-restart"),
    "stopped": ("inactive", "dead"),
    "broken": ("failed", "failed"),
    "done": ("active", "exited"),
}


def run(folder: Path, *units: str) -> tuple[int, str]:
    lines = [
        f"{one}) echo ActiveState={active}; echo SubState={sub};;" for one, (active, sub) in STATES.items()
    ]
    (folder / "systemctl").write_text(
        f"#!/bin/sh\nfor unit; do :; done\ncase $unit in {' '.join(lines)} *) exit 1;; esac\n"
    )
    (folder / "systemctl").chmod(0o755)
    path = f"{folder}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        [str(PROGRAM), *units],
        env={"PATH": path}, capture_output=True, text=True, timeout=PATIENCE, check=False,
    )  # fmt: skip
    return done.returncode, done.stderr.strip()


@pytest.mark.parametrize("unit", ["runs", "waits"])
def test_a_unit_that_runs_or_starts_is_named_with_the_fix(tmp_path: Path, unit: str) -> None:
    code, text = run(tmp_path, "stopped", unit)
    assert code == 1
    assert text == (
        f"systemd runs these nodes already, as {unit}; "
        f"to start them by hand, first: sudo systemctl stop {unit}"
    )


def test_one_command_stops_all_that_run(tmp_path: Path) -> None:
    assert run(tmp_path, "runs", "broken", "waits")[1].endswith("first: sudo systemctl stop runs waits")


@pytest.mark.parametrize("unit", ["stopped", "broken", "done", "no-such-unit"])
def test_nothing_else_is_refused(tmp_path: Path, unit: str) -> None:
    """A computer without systemd, or without the unit, has no answer for it."""
    assert run(tmp_path, unit) == (0, "")
