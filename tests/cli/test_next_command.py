"""SPEC may be left out beside ``swarm.yaml``, and a verb on a terminal names the command that comes next."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import Any

import pytest
import typer

from swarmctl.cli import exit_codes, next_command
from swarmctl.cli.app import app, run
from swarmctl.cli.spec_args import SpecFiles
from swarmctl.cli.where import Where
from swarmctl.lab import paths
from tests.cli.terminal import shown_by

PROGRAM = Path(sys.executable).with_name("swarmctl")


@pytest.fixture
def folder(tmp_path: Path, leader_spec: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copy(leader_spec, tmp_path / "swarm.yaml")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv(paths.STATE_VARIABLE, str(tmp_path))  # the labs that run on this machine are not meant
    return tmp_path


def on_a_terminal(*arguments: str) -> list[str]:
    """The lines that swarmctl prints on a terminal."""
    return shown_by([PROGRAM, *arguments], NO_COLOR="1").splitlines()


@pytest.mark.parametrize(
    ("verb", "expected"),
    [
        (("validate",), "next: swarmctl plan"),
        (("plan", "--offline", "--limit", "k3-pi"), "next: swarmctl deploy --limit k3-pi"),
        (("render", "--out", "out"), "next: swarmctl plan"),
    ],
)
def test_a_verb_ends_with_the_next_command(folder: Path, verb: tuple[str, ...], expected: str) -> None:
    assert on_a_terminal(*verb)[-1] == expected


def test_quiet_and_json_stay_as_they_are(folder: Path) -> None:
    assert on_a_terminal("validate", "--quiet") == []
    assert on_a_terminal("validate", "--json")[-1] == "}"


def test_no_terminal_sees_the_next_command(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["validate"]) == exit_codes.OK
    captured = capsys.readouterr()
    assert captured.out == "swarm.yaml: swarm `newswarm` is valid: 3 robots on 3 hosts, mode leader\n"
    assert captured.err == ""


def test_the_next_command_can_be_pasted() -> None:
    spec = SpecFiles((Path("my lab/swarm.yaml"), Path("night.yaml")))
    shown = Where(spec, lab_name="second", limit=["k3-pi"]).command("status")
    assert shown == "swarmctl status 'my lab/swarm.yaml' -f night.yaml --lab-name second --limit k3-pi"


@pytest.mark.parametrize(
    "arguments",
    [
        ["validate"], ["spec"], ["graph"], ["graph", "--impact"], ["mode", "infer"],
        ["plan", "--offline"], ["render", "--out", "out"],
    ],
)  # fmt: skip
def test_spec_may_be_left_out_beside_swarm_yaml(folder: Path, arguments: list[str]) -> None:
    assert run(arguments) == exit_codes.OK


@pytest.mark.parametrize(
    "arguments",
    [["fault", "unplug", "k3"], ["repair", "k3-pi"], ["shell", "k3-pi", "--", "ls"], ["robots"], ["status"]],
)
def test_a_lab_verb_takes_its_first_word_as_the_robot_or_host(
    folder: Path, arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["lab", *arguments]) == exit_codes.ERROR
    assert "lab newswarm is not up" in capsys.readouterr().err


def test_elsewhere_the_missing_spec_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["validate"]) == exit_codes.USAGE


def test_the_next_command_has_the_workers_if_its_verb_does() -> None:
    spec = SpecFiles((Path("swarm.yaml"),))
    where = Where(spec, limit=["k3-pi"], executor="dask://h:1")
    complete = where.complete
    with_workers = "--executor dask://h:1 --limit k3-pi"
    assert where.command("deploy").endswith(f"deploy {with_workers}")
    assert complete("`swarmctl plan` shows it").startswith(f"`swarmctl plan {with_workers}`")
    assert complete("`swarmctl prepare` installs it").startswith("`swarmctl prepare --limit k3-pi`")
    assert complete("`swarmctl start` first").startswith("`swarmctl start`")


def test_verbs_with_workers_are_those_that_have_the_option() -> None:
    verbs: Any = typer.main.get_command(app)
    context = verbs.make_context("swarmctl", ["plan"], resilient_parsing=True)
    found = {name: verbs.resolve_command(context, [name])[1] for name in verbs.list_commands(context)}
    having = {name for name, one in found.items() if any("--executor" in it.opts for it in one.params)}
    where = ["--executor", "dask://h:1"]
    assert having == {name for name in found if next_command.fitting(name, where) == where}
    assert "deploy" in having
