"""Shell completion offers verbs, the verbs below them, their options and values."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from swarmctl.cli import install_completion
from swarmctl.cli.app import Verbs
from tests.cli.terminal import shown_by

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
        ("swarmctl lab unplug swarm.yaml ", ["koala", "k3", "epuck"]),
        ("swarmctl lab unplug k", ["koala", "k3"]),
        ("swarmctl lab cut k", ["koala-laptop", "k3-pi"]),
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
    assert offered("swarmctl lab unplug swarm.yaml ").strip() == ""


@pytest.mark.parametrize("answer", ["y", "n"])
def test_installing_shows_its_edits_and_waits_for_a_yes(tmp_path: Path, answer: str) -> None:
    rc = tmp_path / ".bashrc"
    rc.write_text("alias ll='ls -l'\n")
    shown = installing(tmp_path, answer)
    line = f"source '{tmp_path}/.bash_completions/swarmctl.sh'"
    assert f"+{line}" in shown
    assert "new file" in shown
    assert (line in rc.read_text()) is (answer == "y")
    assert rc.read_text().startswith("alias ll='ls -l'\n")
    assert (tmp_path / ".bash_completions/swarmctl.sh").exists() is (answer == "y")
    if answer == "y":
        assert "is installed already" in installing(tmp_path, "y")


def test_installing_without_a_terminal_changes_nothing(tmp_path: Path) -> None:
    command = ["bash", "-c", f"{PROGRAM} --install-completion; true"]
    environment = {**os.environ, "HOME": str(tmp_path)}
    done = subprocess.run(
        command, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=True
    )
    assert "nothing was changed" in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("shell", "files"),
    [
        ("zsh", {".zfunc/_swarmctl": "#compdef swarmctl", ".zshrc": "fpath+=~/.zfunc; "}),
        ("fish", {".config/fish/completions/swarmctl.fish": "complete --command swarmctl"}),
    ],
)
def test_each_shell_has_its_own_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, shell: str, files: dict[str, str]
) -> None:
    monkeypatch.setattr(install_completion, "_shell", lambda: shell)
    monkeypatch.setenv("HOME", str(tmp_path))
    found, changes = install_completion._changes()
    assert found == shell
    assert {str(Path(one.file).relative_to(tmp_path)) for one in changes} == set(files)
    assert all(one.after.startswith(files[str(Path(one.file).relative_to(tmp_path))]) for one in changes)


def installing(home: Path, answer: str) -> str:
    """What a bash on a terminal shows."""
    return shown_by(["bash", "-c", f"{PROGRAM} --install-completion; true"], f"{answer}\n", HOME=str(home))
