"""The pre-commit hook: which files it looks at, and the real pre-commit installing and running it."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from tests.ci.jobs import ROOT, without_index

HOOKS = ROOT / ".pre-commit-hooks.yaml"
CONFIG = ROOT / "docs/snippets/pre-commit-config.yaml"
WHO = ("-c", "user.name=test", "-c", "user.email=test@localhost")


def git(folder: Path, *arguments: str) -> str:
    ran = subprocess.run(["git", *WHO, *arguments], cwd=folder, capture_output=True, text=True, check=True)
    return ran.stdout.strip()


def committed(folder: Path) -> str:
    """Everything in a folder as the commit of a new repository."""
    git(folder, "init", "-q")
    git(folder, "add", "-A", "-f")
    git(folder, "commit", "-qm", "all")
    return git(folder, "rev-parse", "HEAD")


def pre_commit(folder: Path, env: dict[str, str], *arguments: str) -> subprocess.CompletedProcess[str]:
    program = [sys.executable, "-m", "pre_commit", *arguments]
    return subprocess.run(program, cwd=folder, env=env, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(("kind", "file"), [("manifest", HOOKS), ("config", CONFIG)])
def test_pre_commit_takes_the_file(kind: str, file: Path, environment: dict[str, str]) -> None:
    assert pre_commit(ROOT, environment, f"validate-{kind}", str(file)).returncode == 0


@pytest.mark.parametrize(
    ("file", "looked_at"),
    [
        ("swarm.yaml", True),
        ("lab/swarm.yml", True),
        ("lab/hall.swarm.yaml", True),
        ("robots/rover.yaml", False),
        ("myswarm.yaml", False),
        ("swarm.lock.yaml", False),
        ("swarm.known_hosts", False),
        ("swarm.yaml.j2", False),
        (".swarmctl/swarm.schema.json", False),
    ],
)
def test_it_looks_at_specs_and_at_nothing_else(file: str, looked_at: bool) -> None:
    (hook,) = yaml.safe_load(HOOKS.read_text("utf-8"))
    assert bool(re.search(hook["files"], file)) is looked_at


@pytest.mark.slow
def test_a_commit_waits_until_its_specs_are_right(
    project: Path, environment: dict[str, str], broken: str, tmp_path: Path
) -> None:
    hooks = tmp_path / "hooks"
    hooks.mkdir()
    for name in ("pyproject.toml", "README.md", "LICENSE", HOOKS.name):
        shutil.copy(ROOT / name, hooks)
    for name in ("swarmctl", "templates", "schemas", "tools"):
        shutil.copytree(ROOT / name, hooks / name, ignore=shutil.ignore_patterns("__pycache__", ".*_cache"))
    config = yaml.safe_load(CONFIG.read_text("utf-8"))
    config["repos"][0] |= {"repo": str(hooks), "rev": committed(hooks)}
    (project / ".pre-commit-config.yaml").write_text(yaml.safe_dump(config))
    committed(project)

    env = environment | {"PRE_COMMIT_HOME": str(tmp_path / "home")}
    made = pre_commit(project, env, "install-hooks")
    if made.returncode and without_index(made.stdout + made.stderr):
        pytest.skip("pip reaches no package index, and pre-commit installs hooks with pip")
    assert made.returncode == 0, made.stdout + made.stderr

    right = pre_commit(project, env, "run", "--all-files")
    assert right.returncode == 0, right.stdout
    (project / "hall/big.swarm.yaml").write_text(broken)
    wrong = pre_commit(project, env, "run", "--all-files")
    assert wrong.returncode == 1
    assert "error[SPEC003]: `mode` cannot be `leadr`\n --> hall/big.swarm.yaml:3:7" in wrong.stdout

    config["repos"][0]["hooks"][0]["args"] = ["--fix"]
    (project / ".pre-commit-config.yaml").write_text(yaml.safe_dump(config))
    git(project, "add", "-A")
    fixed = pre_commit(project, env, "run", "--all-files")
    assert fixed.returncode == 1
    assert "files were modified by this hook" in fixed.stdout
    assert "mode: leader" in (project / "hall/big.swarm.yaml").read_text("utf-8")
