"""Shell completion offers verbs, the verbs below them, their options and values."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from swarmctl.cli.app import Verbs

PROGRAM = Path(sys.executable).with_name("swarmctl")


def offered(line: str, shell: str = "bash") -> str:
    words = {"COMP_WORDS": line, "COMP_CWORD": str(len(line.split(" ")) - 1), "_TYPER_COMPLETE_ARGS": line}
    environment = {**os.environ, **words, "_SWARMCTL_COMPLETE": f"complete_{shell}"}
    return subprocess.run([PROGRAM], env=environment, capture_output=True, text=True, check=True).stdout


def test_every_verb() -> None:
    assert offered("swarmctl ").split() == [verb.name for verb in Verbs.verbs]


def test_verbs_have_their_help() -> None:
    assert '"validate":"Check specs."' in offered("swarmctl v", "zsh")


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("swarmctl va", ["validate"]),
        ("swarmctl mode ", ["infer", "convert"]),
        ("swarmctl driver t", ["test"]),
        ("swarmctl status --j", ["--json"]),
        ("swarmctl validate --format sa", ["sarif"]),
    ],
)
def test_what_follows(line: str, expected: list[str]) -> None:
    assert offered(line).split() == expected
