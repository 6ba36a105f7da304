"""Trials with other parameters: hosts get the spec's own release again, or it is shown that they may not."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

import pytest
import typer

from swarmctl.cli import exit_codes, swarm_look, trial_release
from swarmctl.cli.spec_args import SpecFiles
from swarmctl.cli.trial import TrialError
from swarmctl.cli.trial_release import Releases
from swarmctl.cli.where import Where

EXPERIMENT = """
programs:
  square: {host: koala-laptop, package: moves, executable: square.py, params: {speed: 0.1, name: a}}
experiments:
  squares: {duration: 5, programs: [square], parameters: {square: {%s}}}
"""
Made = Callable[..., Where]
FAST = {"square": {"speed": 0.2}}


@pytest.fixture
def where(leader_spec: Path, tmp_path: Path) -> Made:
    def made(parameters: str = "speed: [0.1, 0.2]") -> Where:
        file = tmp_path / "swarm.yaml"
        file.write_text(leader_spec.read_text("utf-8") + EXPERIMENT % parameters, "utf-8")
        return Where(SpecFiles((file,)))

    return made


@pytest.fixture
def deployed(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """The speed of each deploy."""
    found: list[object] = []
    monkeypatch.setattr(
        trial_release,
        "deploy",
        lambda _, wanted: found.append(wanted.swarm.programs["square"].declared.params["speed"]),
    )
    return found


def releases(where: Where) -> Releases:
    return Releases(where, swarm_look.expected(where))


def test_hosts_have_the_specs_own_release_afterwards(where: Made, deployed: list[object]) -> None:
    with releases(where()) as found:
        found.deploy(FAST)
        assert found.has(FAST)
        assert not found.has({"square": {"speed": 0.20000001}})
    assert (deployed, found.restored) == ([0.2, 0.1], True)


def test_without_another_release_nothing_is_deployed(where: Made, deployed: list[object]) -> None:
    with releases(where()) as found:
        assert found.has({})
    assert (deployed, found.restored) == ([], True)


def test_equal_numbers_of_two_types_are_two_releases(where: Made, deployed: list[object]) -> None:
    with releases(where("speed: [1, 1.0, true]")) as found:
        found.deploy({"square": {"speed": 1}})
        assert not found.has({"square": {"speed": 1.0}})
        assert not found.has({"square": {"speed": True}})


@pytest.mark.parametrize(
    "error", [TrialError("k3-pi: away"), KeyboardInterrupt(), typer.Exit(3), OSError(28, "full")]
)
def test_a_release_that_may_have_stayed_is_named(
    where: Made,
    deployed: list[object],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    error: BaseException,
) -> None:
    def fails(*_: object) -> None:
        raise error

    found = releases(where())
    shown: AbstractContextManager[object] = (
        nullcontext() if isinstance(error, TrialError) else pytest.raises(type(error))
    )
    with shown, found:
        found.deploy(FAST)
        monkeypatch.setattr(trial_release, "deploy", fails)
    assert not found.restored
    assert "hosts may still have the parameters of a trial; `swarmctl deploy" in capsys.readouterr().err


def test_what_may_have_stayed_has_its_exit_code(
    where: Made, deployed: list[object], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> None:
        raise TrialError("k3-pi: away")

    ends = pytest.raises(typer.Exit)
    with ends as caught, releases(where()) as found:
        found.deploy(FAST)
        monkeypatch.setattr(trial_release, "deploy", fails)
        raise typer.Exit(exit_codes.UNHEALTHY)  # the trial did not begin
    assert caught.value.exit_code == exit_codes.HOSTS_FAILED


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ("speed: [0.1, 10000000000000000000000000000000]", "speed"),
        ('name: [a, "{nope}"]', "nope"),
        ("name: [a, [[[[[b]]]]]]", "name"),
    ],
)
def test_all_values_are_checked_before_the_first_trial(
    where: Made, capsys: pytest.CaptureFixture[str], parameters: str, words: str
) -> None:
    try:
        found = releases(where(parameters))
    except typer.Exit:  # the spec itself has it already
        return
    experiment = found.wanted.document.spec.experiments["squares"]
    with found, pytest.raises(typer.Exit):
        found.check(experiment)
    assert words in capsys.readouterr().err
