"""The GitLab template: its script, run in bash with the variables that a job has."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import yaml

from tests.ci.jobs import ROOT, THIS_CHECKOUT, checks, program, ran

TEMPLATE = ROOT / ".gitlab/validate.yml"
JOB = yaml.safe_load(TEMPLATE.read_text("utf-8"))["swarmctl-validate"]
SCRIPT = "\n".join(JOB["script"])


@pytest.fixture
def job(project: Path, tmp_path: Path, environment: dict[str, str]) -> dict[str, str]:
    """The job's variables; its pip records its arguments, as this checkout is installed already."""
    program(tmp_path / "bin/pip", f'echo "$@" > {tmp_path}/arguments')
    path = f"{program(tmp_path / 'bin/swarmctl', THIS_CHECKOUT).parent}:{environment['PATH']}"
    return environment | {"PATH": path, "CI_PROJECT_DIR": str(project)} | JOB["variables"]


def test_it_and_its_example_are_gitlab_ci() -> None:
    for file in (TEMPLATE, ROOT / "docs/snippets/gitlab-ci.yml"):
        judged = checks("gitlab-ci", file)
        assert judged.returncode == 0, judged.stdout


def test_a_right_spec_passes_and_its_reports_are_there(
    job: dict[str, str], project: Path, tmp_path: Path
) -> None:
    done = ran(SCRIPT, project, job)
    assert (done.returncode, done.stderr) == (0, "")
    assert "is valid" in done.stdout
    assert (tmp_path / "arguments").read_text().split()[-1] == "swarmctl"
    for report in JOB["artifacts"]["reports"].values():
        assert (project / report).is_file()


def test_a_wrong_spec_fails_with_its_place_in_every_report(
    job: dict[str, str], project: Path, broken: str
) -> None:
    (project / "hall/big.swarm.yaml").write_text(broken)
    done = ran(SCRIPT, project, job | {"SWARMCTL_SPECS": "swarm.yaml hall/*.swarm.yaml"})
    assert done.returncode == 1
    assert "hall/big.swarm.yaml:3:7" in done.stderr
    (found,) = json.loads((project / JOB["artifacts"]["reports"]["codequality"]).read_text("utf-8"))
    assert found["location"]["path"] == "hall/big.swarm.yaml"
    assert ET.parse(project / JOB["artifacts"]["reports"]["junit"]).find(".//failure") is not None


def test_strict(job: dict[str, str], project: Path) -> None:
    with (project / "swarm.yaml").open("a") as file:
        file.write("\nprograms:\n  joystick: {host: koala-laptop, use: teleop-joy}\n")
    assert ran(SCRIPT, project, job).returncode == 0
    assert ran(SCRIPT, project, job | {"SWARMCTL_FLAGS": "--strict"}).returncode == 1


def test_the_example_changes_variables_that_there_are() -> None:
    example = yaml.safe_load((ROOT / "docs/snippets/gitlab-ci.yml").read_text("utf-8"))
    assert set(example["swarmctl-validate"]["variables"]) <= set(JOB["variables"])
    assert example["include"][0]["file"] == f"/{TEMPLATE.relative_to(ROOT)}"
