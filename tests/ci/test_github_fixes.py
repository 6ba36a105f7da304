"""The workflow that commits safe fixes: its script, run in bash in a clone of a repository."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from tests.ci.jobs import ROOT, THIS_CHECKOUT, checks, program, ran
from tests.ci.test_pre_commit import committed, git

WORKFLOW = ROOT / "docs/snippets/github-fixes.yml"
STEPS = yaml.safe_load(WORKFLOW.read_text("utf-8"))["jobs"]["fix"]["steps"]


@pytest.fixture
def bare(project: Path, tmp_path: Path) -> Path:
    """The repository that the project is pushed to."""
    committed(project)
    git(tmp_path, "clone", "-q", "--bare", str(project), "swarm.git")
    git(project, "remote", "add", "origin", str(tmp_path / "swarm.git"))
    git(project, "push", "-q", "--set-upstream", "origin", "HEAD")
    return tmp_path / "swarm.git"


def fixed(project: Path, tmp_path: Path, environment: dict[str, str], text: str) -> int:
    """Commits a spec, runs the step and returns its exit code."""
    (project / "swarm.yaml").write_text(text)
    git(project, "commit", "-qam", "a spec", "--allow-empty")
    git(project, "push", "-q")
    tools = program(tmp_path / "bin/swarmctl", THIS_CHECKOUT).parent
    return ran(STEPS[-1]["run"], project, environment | {"PATH": f"{tools}:{environment['PATH']}"}).returncode


def test_it_is_a_workflow() -> None:
    judged = checks("github-workflows", WORKFLOW)
    assert judged.returncode == 0, judged.stdout


def test_safe_fixes_are_committed_and_pushed(
    bare: Path, project: Path, tmp_path: Path, environment: dict[str, str]
) -> None:
    right = (project / "swarm.yaml").read_text("utf-8")
    wrong = right.replace("mode: leader", "mode: leadr")
    assert fixed(project, tmp_path, environment, wrong) == 0
    assert git(bare, "show", "HEAD:swarm.yaml") == right.strip()
    assert git(bare, "log", "-1", "--format=%s") == "Fixes of swarmctl validate"


@pytest.mark.parametrize("change", ["mode: leader", "mode: quorum"], ids=["right", "without-fix"])
def test_nothing_is_committed_without_a_fix(
    change: str, bare: Path, project: Path, tmp_path: Path, environment: dict[str, str]
) -> None:
    text = (project / "swarm.yaml").read_text("utf-8").replace("mode: leader", change)
    assert fixed(project, tmp_path, environment, text) == 0
    assert git(bare, "log", "-1", "--format=%s") == "a spec"
