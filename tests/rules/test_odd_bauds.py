"""The baud rate proposed in place of an odd one is a rate of the robot."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from tests import ROOT

EXAMPLE = ROOT / "examples/arduino-rover/swarm.yaml"


@pytest.mark.parametrize("baud", [14400, 76800, 250000])
def test_a_non_standard_baud_is_fixed_to_one_the_robot_supports(
    baud: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = EXAMPLE.read_text("utf-8")
    [line] = [one for one in text.splitlines() if "kind: serial" in one]
    spec = tmp_path / "swarm.yaml"
    spec.write_text(text.replace(line, line.replace("}", f"}}, baud: {baud}", 1)), "utf-8")
    assert run(["validate", str(spec), "--fix"]) == exit_codes.OK
    assert "baud: 57600}" in spec.read_text("utf-8")
    capsys.readouterr()
    assert run(["validate", str(spec)]) == exit_codes.OK
    assert capsys.readouterr().err == ""
