"""A baud rate is corrected where a typing error explains it, and nothing else does."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from tests import ROOT

EXAMPLE = ROOT / "examples/arduino-rover/swarm.yaml"


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    spec = tmp_path / "swarm.yaml"
    text = EXAMPLE.read_text("utf-8")
    [line] = [one for one in text.splitlines() if "kind: serial" in one]
    spec.write_text(text.replace(line, line.replace("}", "}, baud: BAUD", 1)), "utf-8")
    return spec


@pytest.mark.parametrize("baud", [5760, 567600, 57500, 75600])
def test_a_digit_too_few_or_wrong_is_corrected_to_the_robots_rate(
    baud: int, spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec.write_text(spec.read_text("utf-8").replace("BAUD", str(baud)), "utf-8")
    assert run(["validate", str(spec), "--fix"]) == exit_codes.OK
    assert "baud: 57600}" in spec.read_text("utf-8")
    capsys.readouterr()
    assert run(["validate", str(spec)]) == exit_codes.OK
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("baud", [14400, 76800, 250000])
def test_a_rate_that_no_typing_error_explains_is_left_alone(
    baud: int, spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = spec.read_text("utf-8").replace("BAUD", str(baud))
    spec.write_text(text, "utf-8")
    run(["validate", str(spec), "--unsafe-fixes"])
    assert spec.read_text("utf-8") == text
    assert "57600" in capsys.readouterr().err
