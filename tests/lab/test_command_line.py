"""``swarmctl lab`` where no lab is: what it says, on which stream, with which exit code."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

import pytest

from swarmctl.cli.verbs.lab import lab
from tests import in_process
from tests.lab.lab_values import SPEC, changed

VERBS = sorted(command.callback.__name__ for command in lab.registered_commands if command.callback)
AS_ROOT = pytest.mark.skipif(os.geteuid() != 0, reason="needs root, to become somebody else")


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    (tmp_path / "tiny.yaml").write_text(SPEC)
    return tmp_path / "tiny.yaml"


def swarmctl(state: Path, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return in_process.swarmctl("lab", *map(str, arguments), env={"SWARMCTL_STATE": str(state)})


def test_the_verbs() -> None:
    assert sorted(["up", "down", "status", "robots", "shell", "repair", "scenario"]) == VERBS


@pytest.mark.parametrize(
    "arguments",
    [
        ["status"], ["robots"], ["shell", "alpha"], ["shell", "operator", "--", "true"],
        ["fault unplug", "rover"], ["fault link-down", "alpha"], ["repair"], ["repair", "alpha"],
    ],
    ids=lambda arguments: arguments[0],
)  # fmt: skip
def test_a_lab_that_is_not_up(spec: Path, tmp_path: Path, arguments: list[str]) -> None:
    verb, *rest = arguments
    ran = swarmctl(tmp_path, *verb.split(), spec, *rest)
    assert (ran.returncode, ran.stdout) == (1, "")
    assert ran.stderr == f"error: lab tiny is not up\n  help: run `swarmctl lab up {spec}` first\n"


@AS_ROOT
def test_nothing_to_take_down_is_no_error(spec: Path, tmp_path: Path) -> None:
    ran = swarmctl(tmp_path, "down", spec)
    assert (ran.returncode, ran.stderr) == (0, "lab tiny: does not exist\n")
    ran = swarmctl(tmp_path, "down", "--all")
    assert (ran.returncode, ran.stderr) == (0, "")


def test_down_asks_which(tmp_path: Path) -> None:
    ran = swarmctl(tmp_path, "down")
    assert (ran.returncode, ran.stdout) == (1, "")
    assert ran.stderr == "error: the lab is missing\n  help: give its spec, --name or --all\n"


@pytest.mark.parametrize("verb", ["up", "down", "status"])
def test_a_name_with_a_path_is_refused(spec: Path, tmp_path: Path, verb: str) -> None:
    (tmp_path / "precious").mkdir()
    ran = swarmctl(tmp_path / "state", verb, spec, "--name", "../../precious")
    assert ran.returncode == 1
    assert "cannot be the name of a lab" in ran.stderr
    assert (tmp_path / "precious").is_dir()


def test_a_spec_that_is_impossible_in_a_lab(tmp_path: Path) -> None:
    spec = tmp_path / "operator.yaml"
    spec.write_text(changed().replace("beta", "operator"))
    ran = swarmctl(tmp_path, "up", spec)
    assert (ran.returncode, ran.stdout) == (1, "")
    assert "`operator` is the lab's name for this machine" in ran.stderr
    assert "Traceback" not in ran.stderr


@pytest.mark.parametrize("verb", ["up", "down"])
def test_without_root_it_is_an_error(verb: str, spec: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    ran = in_process.swarmctl("lab", verb, str(spec))
    assert ran.returncode == 1
    assert ran.stderr == (
        "error: a lab boots real hosts and needs root\n  help: run the same command with sudo\n"
    )


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_has_help(verb: str, tmp_path: Path) -> None:
    ran = swarmctl(tmp_path, verb, "--help")
    assert ran.returncode == 0
    assert re.match(rf"Usage: swarmctl lab {verb} ", ran.stdout)
