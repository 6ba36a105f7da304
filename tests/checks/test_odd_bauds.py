"""What is advised in the place of an odd baud rate is one at which the robot speaks."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.cli import exits
from swarmctl.cli.app import run

EXAMPLE = Path(__file__).parents[2] / "examples/arduino-rover/swarm.yaml"


@pytest.mark.parametrize("baud", [14400, 76800, 250000])
def test_an_odd_baud_rate_is_mended_to_one_that_the_robot_speaks(
    baud: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = EXAMPLE.read_text("utf-8")
    [line] = [one for one in text.splitlines() if "kind: serial" in one]
    spec = tmp_path / "swarm.yaml"
    spec.write_text(text.replace(line, line.replace("}", f"}}, baud: {baud}", 1)), "utf-8")
    assert run(["validate", str(spec), "--fix"]) == exits.OK
    assert "baud: 57600}" in spec.read_text("utf-8")
    capsys.readouterr()
    assert run(["validate", str(spec)]) == exits.OK
    assert capsys.readouterr().err == ""
