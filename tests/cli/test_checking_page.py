"""docs/checking.md: its commands run, its document is what swarmctl prints, its tables leave nothing out."""

from __future__ import annotations

import re
import shlex
import subprocess
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.finding_output import Format
from tests import ROOT, in_process

PAGE = (ROOT / "docs/checking.md").read_text("utf-8")
COMMANDS = re.findall(r"^swarmctl (validate .+?)(?: +#.*)?$", PAGE, re.MULTILINE)


@pytest.fixture
def folder(tmp_path: Path, leader_spec: Path) -> Path:
    """The example without its first line, and with a host that the radio does not reach."""
    text = leader_spec.read_text("utf-8").split("\n", 1)[1]
    (tmp_path / "swarm.yaml").write_text(text.replace("[koala-laptop, k3-pi,", "[koala-laptop,"), "utf-8")
    return tmp_path


def swarmctl(folder: Path, command: str) -> subprocess.CompletedProcess[str]:
    return in_process.swarmctl(*shlex.split(command), cwd=folder)


@pytest.mark.parametrize("command", COMMANDS)
def test_the_commands_run(command: str, folder: Path) -> None:
    ran = swarmctl(folder, command)
    # To which network a host belongs is a guess: no safe fix is there to show.
    right = "--unsafe-fixes" in command or "--diff" in command
    assert ran.returncode == (exit_codes.OK if right else exit_codes.ERROR)
    written = "".join(one.read_text("utf-8") for one in folder.iterdir() if one.suffix != ".yaml")
    assert ("--quiet" in command) == (not ran.stdout + ran.stderr + written)
    assert "bug in swarmctl" not in ran.stderr


def test_the_document_is_what_is_printed(folder: Path) -> None:
    (document,) = re.findall("```json\n(.+?)```", PAGE, re.DOTALL)
    assert swarmctl(folder, "validate swarm.yaml --json").stdout == document


def test_every_key_and_every_format_is_explained() -> None:
    explained = set(re.findall(r"^\| `(\w+)` \|", PAGE, re.MULTILINE))
    (document,) = re.findall("```json\n(.+?)```", PAGE, re.DOTALL)
    keys = set(re.findall('"([a-z]+)":', document)) - {
        "file",
        "line",
        "column",
        "swarm",
        "title",
        "edits",
        "text",
        "safe",
        "fixable",
    }
    assert keys | {one.value for one in Format} == explained
    assert {one for command in COMMANDS for one in re.findall(r"--format (\w+)", command)} | {
        "human",
        "json",
    } == {one.value for one in Format}
