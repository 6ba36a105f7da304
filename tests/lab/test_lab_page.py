"""docs/lab.md: every command on the page is run, in the order of the page, with the example swarm."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from swarmctl.cli.verbs.lab import lab
from swarmctl.lab import paths
from tests import ROOT
from tests.lab.tiny_labs import SWARMCTL, in_a_lab, left_of

PAGE = (ROOT / "docs/lab.md").read_text("utf-8")
BLOCKS = re.findall(r"^```sh\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
VERBS = [command.callback.__name__ for command in lab.registered_commands if command.callback]


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_has_an_example(verb: str) -> None:
    assert re.search(rf"^swarmctl lab {verb} ", "".join(BLOCKS), re.MULTILINE)


def test_the_variables_for_folders_are_documented() -> None:
    for documented in (paths.STATE_VARIABLE, paths.CACHE_VARIABLE, paths.DEFAULT_STATE, paths.DEFAULT_CACHE):
        assert str(documented) in PAGE


@in_a_lab
@pytest.mark.slow
def test_the_commands_of_the_page_run(
    leader_spec: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(paths.STATE_VARIABLE, str(tmp_path / "state"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "journal"))
    monkeypatch.setenv("PATH", f"{SWARMCTL.parent}:{os.environ['PATH']}")
    shutil.copy(leader_spec, tmp_path / "swarm.yaml")
    try:
        for block in BLOCKS:
            ran = subprocess.run(
                ("bash", "-euo", "pipefail", "-c", block), cwd=tmp_path, stdin=subprocess.DEVNULL,
                capture_output=True, text=True, timeout=120, check=False,
            )  # fmt: skip
            assert ran.returncode == 0, block + ran.stdout + ran.stderr
            promised = re.findall(r'"exit code \$\?: ', block)
            assert len(re.findall(r"^exit code \d", ran.stdout, re.MULTILINE)) == len(promised), ran.stdout
        assert left_of(paths.lab_paths("newswarm")) == left_of(paths.lab_paths("second")) == []
    finally:
        subprocess.run((SWARMCTL, "lab", "down", "--all"), capture_output=True, check=False)
