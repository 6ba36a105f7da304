"""Shell completion offers verbs, the verbs below them, their options and values."""

from __future__ import annotations

import os
import shutil
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
        ("swarmctl lab fault re", ["reboot", "read-only"]),
        ("swarmctl status --j", ["--json", "--junit"]),
        ("swarmctl validate --format sa", ["sarif"]),
        ("swarmctl explain DEV00", [f"DEV00{number}" for number in (1, 2, 3, 4, 5, 7, 8, 9)]),
        ("swarmctl driver show kh", ["khepera3"]),
        ("swarmctl driver test kh", ["khepera3"]),
        ("swarmctl emulate kh", ["khepera3"]),
        ("swarmctl mode convert --to c", ["central", "combined"]),
    ],
)
def test_what_follows(line: str, expected: list[str]) -> None:
    assert offered(line).split() == expected


@pytest.fixture
def here(tmp_path: Path, leader_spec: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copy(leader_spec, tmp_path / "swarm.yaml")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("swarmctl lab fault unplug swarm.yaml ", ["koala", "k3", "epuck"]),
        ("swarmctl lab fault unplug k", ["koala", "k3"]),
        ("swarmctl lab fault link-down k", ["koala-laptop", "k3-pi"]),
        ("swarmctl lab repair swarm.yaml k3", ["k3-pi", "k3"]),
        ("swarmctl lab shell swarm.yaml o", ["operator"]),
        ("swarmctl firmware flash swarm.yaml e", ["epuck"]),
        ("swarmctl deploy swarm.yaml --limit k", ["koala-laptop", "k3-pi", "koala", "k3"]),
        ("swarmctl lab up --only type:e", ["type:epuck"]),
        ("swarmctl status --limit host:k3", ["host:k3-pi"]),
        ("swarmctl render --limit koala,!ep", ["koala,!epuck-pi", "koala,!epuck"]),
    ],
)
def test_robots_and_hosts_of_the_spec(here: Path, line: str, expected: list[str]) -> None:
    assert offered(line).split() == expected


def test_a_wrong_spec_offers_nothing(here: Path) -> None:
    (here / "swarm.yaml").write_text("robots: [")
    assert offered("swarmctl lab fault unplug swarm.yaml ").strip() == ""
