"""``swarmctl firmware``: from a spec to a program for a board, and to the commands that write it."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.firmware import compiler
from swarmctl.firmware.compiler import RAM
from swarmctl.render.build_bundle import bundles
from swarmctl.render.sketch import sketch_of
from tests import ROOT
from tests.loading import load_swarm

GOLDEN = Path(__file__).parent / "golden"
EXAMPLE = ROOT / "examples/arduino-rover/swarm.yaml"
TUNED = """
robots:
  rover:
    settings:
      firmware: {left: {enable: 9, pwm_min: 72.5}, kp: 6.0, stop: coast}
      calibration: {wheel_separation: 0.134, distance_scale: 1.02}
"""


def test_the_settings_of_the_example(golden: Callable[[Path, str], None]) -> None:
    swarm, _ = load_swarm(EXAMPLE)
    assert swarm is not None
    [config] = [file for file in bundles(swarm)["rover-pi"].files if file.path == "firmware/rover/config.h"]
    assert config.origin == "robots.rover"
    golden(GOLDEN / "config.h", config.content.decode())


def test_the_page_names_the_firmware_that_the_example_makes() -> None:
    swarm, _ = load_swarm(EXAMPLE)
    assert swarm is not None
    made = sketch_of(swarm.robots["rover"])
    assert made is not None
    named = re.findall(r"\b[0-9a-f]{12}\b", (ROOT / "docs/firmware.md").read_text("utf-8"))
    assert set(named) == {made.digest}


def test_what_is_measured_on_a_robot_is_in_its_sketch(
    tmp_path: Path, golden: Callable[[Path, str], None]
) -> None:
    over = tmp_path / "tuned.yaml"
    over.write_text(TUNED)
    plain, tuned = load_swarm(EXAMPLE)[0], load_swarm(EXAMPLE, over)[0]
    assert plain is not None
    assert tuned is not None
    before, after = sketch_of(plain.robots["rover"]), sketch_of(tuned.robots["rover"])
    assert before is not None
    assert after is not None
    assert before.digest != after.digest
    golden(GOLDEN / "tuned.h", after.sources["config.h"].decode())


def test_another_sketch_restarts_no_driver() -> None:
    swarm, _ = load_swarm(EXAMPLE)
    assert swarm is not None
    units = bundles(swarm)["rover-pi"].units
    assert not [path for unit in units for path in unit.needs if path.startswith("firmware/")]


def test_build_prints_the_sizes(
    tools: compiler.Toolchain, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["firmware", "build", str(EXAMPLE), "--out", str(tmp_path), "--json"]) == exit_codes.OK
    [output] = json.loads(capsys.readouterr().out)["firmware"]
    assert output["robot"] == "rover"
    assert output["data"] < RAM / 2
    digest = output["digest"].encode()
    assert digest in Path(output["elf"]).read_bytes()
    assert Path(output["hex"]).read_text().startswith(":10")


def test_flash_shows_what_it_would_do(
    tools: compiler.Toolchain, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert (
        run(["firmware", "flash", str(EXAMPLE), "rover", "--out", str(tmp_path), "--dry-run"])
        == exit_codes.OK
    )
    output = capsys.readouterr().out
    assert f"rover: {tmp_path}/rover.hex, firmware " in output
    assert "rover, on rover-pi (ubuntu@192.168.77.30):" in output
    assert "avrdude -p atmega328p -c arduino -P /dev/swarm/rover -b 115200" in output


@pytest.mark.parametrize(
    ("robot", "spec", "message"),
    [
        ("rovr", EXAMPLE, "there is no host or robot called `rovr`"),
        ("koala", ROOT / "examples/paper-leader/swarm.yaml", "robot `koala` has no board"),
    ],
)
def test_a_robot_without_such_a_board(
    robot: str, spec: Path, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["firmware", "build", str(spec), robot]) == exit_codes.ERROR
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(("missing", "package"), [("avr-g++", "gcc-avr"), ("avr-objcopy", "binutils-avr")])
def test_a_missing_tool_is_named_with_its_package(
    missing: str, package: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(compiler.shutil, "which", lambda name: None if name == missing else f"/bin/{name}")
    assert run(["firmware", "build", str(EXAMPLE)]) == exit_codes.ERROR
    output = capsys.readouterr().err
    assert f"{missing} is missing" in output
    assert f"sudo apt install {package}" in output
