"""docs/lab.md: every command on the page is run, in the order of the page, with the example swarm."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from tiny_labs import SWARMCTL, in_a_lab, left_of

from swarmctl.cli.lab import lab
from swarmctl.lab import places

PAGE = (Path(__file__).parents[2] / "docs/lab.md").read_text("utf-8")
BLOCKS = re.findall(r"^```sh\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
VERBS = [command.callback.__name__ for command in lab.registered_commands if command.callback]


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_is_shown_by_example(verb: str) -> None:
    assert re.search(rf"^swarmctl lab {verb} ", "".join(BLOCKS), re.MULTILINE)


def test_what_moves_the_labs_folders_is_told() -> None:
    for told in (places.STATE_VARIABLE, places.CACHE_VARIABLE, places.DEFAULT_STATE, places.DEFAULT_CACHE):
        assert str(told) in PAGE


@in_a_lab
def test_the_commands_of_the_page(leader_spec: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(places.STATE_VARIABLE, str(tmp_path / "state"))
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
        assert left_of(places.home("newswarm")) == left_of(places.home("second")) == []
    finally:
        subprocess.run((SWARMCTL, "lab", "down", "--all"), capture_output=True, check=False)
