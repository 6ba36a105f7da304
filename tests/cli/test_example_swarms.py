"""Every example has its declared mode, and the graph in its golden file."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from tests import ROOT
from tests.loading import load_swarm

GOLDEN = Path(__file__).parent / "golden/examples"
SPECS = sorted((ROOT / "examples").glob("*/swarm.yaml"))
OVERLAID = [(path.parent / "swarm.yaml", path) for path in sorted((ROOT / "examples").glob("*/fkie.yaml"))]


def name_of(path: Path) -> str:
    return path.parent.name


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    monkeypatch.setenv("NO_COLOR", "1")


def printed(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert run(list(arguments)) == exit_codes.OK
    return capsys.readouterr().out


@pytest.mark.parametrize(("spec", "overlay"), OVERLAID, ids=lambda path: path.parent.name)
def test_an_example_is_free_of_findings_with_its_overlay_too(
    spec: Path, overlay: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["validate", "--strict", str(spec), "-f", str(overlay)]) == exit_codes.OK, (
        capsys.readouterr().err
    )


@pytest.mark.parametrize("spec", SPECS, ids=name_of)
def test_its_wiring_is_the_mode_that_it_says(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    printed(capsys, "mode", "infer", str(spec))


@pytest.mark.parametrize("spec", SPECS, ids=name_of)
def test_word_for_word(
    spec: Path, golden: Callable[[Path, str], None], capsys: pytest.CaptureFixture[str]
) -> None:
    parts = {
        "": printed(capsys, "graph", str(spec)),
        "\ncommand paths\n": printed(capsys, "graph", str(spec), "--paths"),
    }
    text = "".join(title + part for title, part in parts.items() if part.strip())
    golden(GOLDEN / f"{name_of(spec)}.txt", text)


def test_the_papers_five_experiments_are_its_five_modes() -> None:
    modes = []
    for spec in SPECS:
        swarm, _ = load_swarm(spec)
        if swarm is not None and re.fullmatch(r"paper-\d-.*", name_of(spec)):
            modes.append((name_of(spec), swarm.mode.value))
    assert [name.split("-", 2)[2] for name, _ in modes] == [mode for _, mode in modes]
    assert len(set(modes)) == 5
