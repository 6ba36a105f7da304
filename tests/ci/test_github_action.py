"""The GitHub Action: its scripts, run in bash with the variables that a runner sets."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.ci.jobs import (
    ROOT,
    THIS_CHECKOUT,
    checks,
    program,
    ran,
    without_index,
)

ACTION = ROOT / ".github/actions/validate/action.yml"
INSTALL, VALIDATE = yaml.safe_load(ACTION.read_text("utf-8"))["runs"]["steps"]


@pytest.fixture
def runner(project: Path, tmp_path: Path, environment: dict[str, str]) -> dict[str, str]:
    """The variables of a step; the page of the job is the file `summary.md`."""
    (tmp_path / "temp").mkdir()
    return environment | {
        "GITHUB_ACTIONS": "true",
        "GITHUB_ACTION_PATH": str(ACTION.parent),
        "GITHUB_WORKSPACE": str(project),
        "GITHUB_STEP_SUMMARY": str(tmp_path / "summary.md"),
        "RUNNER_TEMP": str(tmp_path / "temp"),
    }


@pytest.fixture
def installed(runner: dict[str, str], tmp_path: Path) -> dict[str, str]:
    """The same after the first step, which has put this checkout's swarmctl where the second looks."""
    program(tmp_path / "temp/swarmctl/bin/swarmctl", THIS_CHECKOUT)
    return runner


def inputs(step: dict[str, Any], **given: str) -> dict[str, str]:
    """What stands in the variables of a step for these inputs."""
    known = yaml.safe_load(ACTION.read_text("utf-8"))["inputs"]
    assert set(given) <= set(known)
    values = {name: given.get(name, one["default"]) for name, one in known.items()}
    return {
        key: re.sub(r"\$\{\{ inputs\.(\w+) \}\}", lambda found: values[found[1]], text)
        for key, text in step["env"].items()
    }


def test_it_is_an_action_and_the_example_a_workflow() -> None:
    for kind, file in (
        ("github-actions", ACTION),
        ("github-workflows", ROOT / "docs/snippets/github-workflow.yml"),
    ):
        judged = checks(kind, file)
        assert judged.returncode == 0, judged.stdout


def test_no_input_is_pasted_into_a_script() -> None:
    assert [step["name"] for step in (INSTALL, VALIDATE) if "${{" in step["run"]] == []


@pytest.mark.slow
def test_it_installs_what_it_came_with(runner: dict[str, str], project: Path) -> None:
    made = ran(INSTALL["run"], project, runner | inputs(INSTALL))
    if made.returncode and without_index(made.stderr):
        pytest.skip("pip reaches no package index")
    assert made.returncode == 0, made.stderr
    done = ran(VALIDATE["run"], project, runner | inputs(VALIDATE))
    assert (done.returncode, done.stderr) == (0, "no findings in 2 specs\n")


def test_a_version_is_taken_from_the_index(runner: dict[str, str], project: Path, tmp_path: Path) -> None:
    """The arguments of pip, printed by a stand-in."""
    program(tmp_path / "temp/swarmctl/bin/pip", 'echo "$@"')
    path = f"{program(tmp_path / 'bin/python3', ':').parent}:{runner['PATH']}"
    pip = ran(INSTALL["run"], project, runner | {"PATH": path} | inputs(INSTALL, version="0.1.0"))
    assert pip.stdout.split()[-1] == "swarmctl==0.1.0"


def test_right_specs_pass_without_a_word(installed: dict[str, str], project: Path) -> None:
    done = ran(VALIDATE["run"], project, installed | inputs(VALIDATE))
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "no findings in 2 specs\n")


def test_a_wrong_spec_fails_with_an_annotation_in_its_line(
    installed: dict[str, str], project: Path, broken: str, tmp_path: Path
) -> None:
    (project / "hall/big.swarm.yaml").write_text(broken)
    done = ran(VALIDATE["run"], project, installed | inputs(VALIDATE))
    assert done.returncode == 1
    assert done.stdout.startswith("::error title=SPEC003,file=hall/big.swarm.yaml,line=3,")
    assert "SPEC003" in (tmp_path / "summary.md").read_text("utf-8")


def test_sarif_is_written_whether_it_fails_or_not(
    installed: dict[str, str], project: Path, broken: str
) -> None:
    for text, code in ((broken, 1), ((project / "swarm.yaml").read_text(), 0)):
        (project / "swarm.yaml").write_text(text)
        done = ran(VALIDATE["run"], project, installed | inputs(VALIDATE, sarif="found.sarif"))
        assert done.returncode == code
        (one,) = json.loads((project / "found.sarif").read_text("utf-8"))["runs"]
        assert len(one["results"]) == code


@pytest.mark.parametrize(("strict", "code"), [("true", 1), ("false", 0)])
def test_strict(strict: str, code: int, installed: dict[str, str], project: Path) -> None:
    with (project / "swarm.yaml").open("a") as file:
        file.write("\nprograms:\n  joystick: {host: koala-laptop, use: teleop-joy}\n")
    done = ran(VALIDATE["run"], project, installed | inputs(VALIDATE, strict=strict, spec="swarm.yaml"))
    assert done.returncode == code


@pytest.mark.parametrize(
    ("spec", "output"),
    [
        ("nowhere/*.yaml", "::error::no file matches the input spec\n"),
        ("$(touch owned)", "there is no file `$(touch owned)`"),
        ("--format=json", "there is no file `--format=json`"),
        ("swarm.yaml; touch owned", "there is no file `swarm.yaml; touch owned`"),
    ],
)
def test_what_stands_in_an_input_is_a_name_and_never_a_command(
    spec: str, output: str, installed: dict[str, str], project: Path
) -> None:
    done = ran(VALIDATE["run"], project, installed | inputs(VALIDATE, spec=spec))
    assert done.returncode == 1
    assert output in done.stdout
    assert not (project / "owned").exists()
