"""docs/editors-and-ci.md: each of its blocks is a file that other tests try, or a command that runs here."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

from tests import ROOT

PAGE = (ROOT / "docs/editors-and-ci.md").read_text("utf-8")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


def test_its_files_are_the_tried_ones() -> None:
    shown = {text for language, text in BLOCKS if language != "sh"}
    spec = (ROOT / "templates/project/swarm.yaml.j2").read_text("utf-8")
    tried = {file.read_text("utf-8") for file in (ROOT / "docs/snippets").iterdir()}
    assert shown == tried | {"".join(spec.splitlines(keepends=True)[:2])}


def test_its_commands_run_one_after_the_other(tmp_path: Path) -> None:
    script = "".join(text for language, text in BLOCKS if language == "sh")
    env = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    ran = subprocess.run(
        ["bash", "-exc", script], cwd=tmp_path, env=env, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr
    assert {"swarm.yaml", ".swarmctl"} == {file.name for file in tmp_path.iterdir()}
