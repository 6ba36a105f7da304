"""Runs docs/own-robot.md: its files and commands, in their order, in an empty folder."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests import ROOT
from tests.timing import PATIENCE

PAGE = ROOT / "docs/own-robot.md"
_BLOCK = re.compile(r"^```(\w+) ?(\S*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def script(*, lab: bool) -> str:
    """The page's files and commands as one script: those of `sh lab`, which need a lab, or all others."""
    lines = ["set -eum"]  # -m: a program in the background is `%1`, as at a prompt
    lines.append("trap 'kill $(jobs -p) 2>/dev/null || :' EXIT")  # after a failure, too
    for language, name, text in _BLOCK.findall(PAGE.read_text("utf-8")):
        if language == "sh" and lab == (name == "lab"):
            lines.append(text)
        elif language != "sh" and name:
            lines.append(f"mkdir -p $(dirname {name}); cat > {name} <<'END-OF-FILE'\n{text}END-OF-FILE\n")
    return "\n".join(lines)


def followed(folder: Path, *, lab: bool) -> subprocess.CompletedProcess[str]:
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    return subprocess.run(
        ["bash", "-c", script(lab=lab)], cwd=folder, env={**os.environ, "PATH": path, "NO_COLOR": "1"},
        stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=10 * PATIENCE, check=False,
    )  # fmt: skip


@pytest.mark.slow
def test_the_page_runs_as_it_stands(tmp_path: Path, note: Callable[[str, str, str], None]) -> None:
    began = time.monotonic()
    ran = followed(tmp_path, lab=False)
    if ran.returncode and "no reply" in ran.stdout and os.getloadavg()[0] > (os.cpu_count() or 1):
        shutil.rmtree(tmp_path)  # a busy machine answered later than the type's 0.2 s
        tmp_path.mkdir()
        ran = followed(tmp_path, lab=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    note("docs/own-robot.md, followed by a machine", f"{time.monotonic() - began:.0f} s", "<= 10 min by hand")
    assert "`wheel_separation` is empty; it must be a number" in ran.stderr
    assert ran.stdout.count("the robot matches its type") == 3
    report = json.loads((tmp_path / "report.json").read_text())
    assert (report["passed"], {one["verdict"] for one in report["results"]}) == (True, {"ok"})
    assert {"sensor floor", "actuator lamp"} <= {one["check"] for one in report["results"]}
    assert ran.stdout.count("sent; the robot answers no command") == 3  # the hare does not confirm a stop
    assert "swarm `garden` is valid" in ran.stdout
    assert (tmp_path / "out/pi/params/benny.yaml").is_file()


@pytest.mark.lab
@pytest.mark.slow
def test_the_page_drives_its_robot_in_the_lab(tmp_path: Path) -> None:
    ran = followed(tmp_path, lab=True)
    subprocess.run(
        [str(Path(sys.executable).with_name("swarmctl")), "lab", "down", "--name", "garden"],
        capture_output=True, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stdout + ran.stderr
    driven = re.search(r"^benny .*$", ran.stdout, re.MULTILINE)
    assert driven is not None
    assert 0.05 < float(driven[0].split()[1]) < 0.4, driven[0]  # 0.1 m/s for at most 3 s
