"""The protocol class beside a type: looked at before it is on a robot, and never run here."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.spec.catalog import load_catalog
from swarmctl.yamltext.files import MAX_CODEC_BYTES

TYPE = """\
title: Snail
link: {kinds: [serial], baud: 115200}
kinematics:
  wheel_separation: 0.08
  wheel_speed_max: 0.25
  scales: [{speed_units_per_mps: 1000, metres_per_count: 0.0005}]
protocol:
  kind: python
  codec: SnailCodec
  set_speed: {request: 16, reply: 8}
  queries: {position: {values: 2, request: 8, reply: 24}}
sensors:
  odom: {kind: wheels, read: position}
firmware_dead_man: false
"""
CODEC = """\
import sys
sys.exit("nobody runs this here")

class SnailCodec:
    def __init__(self, options): ...
    def speed(self, left, right): ...
    def query(self, name): ...
"""
SPEC = """\
version: 1
name: garden
mode: leader
leader: pi
ros: {distro: noetic}
hosts: {pi: {address: 192.168.77.10, user: robot}}
robots: {sid: {type: snail, host: pi}}
links:
  - {kind: serial, host: pi, robot: sid, usb: {serial: SNAIL1}}
"""
GOLDEN = Path(__file__).parent / "golden/codecs"
WRONG = {
    "no-file": ("CODEC001", TYPE, None),
    "no-class": ("CODEC001", TYPE.replace("codec: SnailCodec", "codec: SnialCodec"), CODEC),
    "no-class-at-all": ("CODEC001", TYPE, "x = 1\n"),
    "newer-python": (
        "CODEC002",
        TYPE,
        CODEC + "    def more(self, x):\n        match x:\n            case 1: ...\n",
    ),
    "bracket": ("CODEC002", TYPE, CODEC.replace("(self, name)", "(self, name")),
    "too-large": ("FILE002", TYPE, CODEC + "#" * MAX_CODEC_BYTES),
    "null-byte": ("CODEC002", TYPE, CODEC + "\0"),
    "no-method": ("CODEC003", TYPE, CODEC.replace("def speed", "def spede")),
    "other-arguments": ("CODEC003", TYPE, CODEC.replace("left, right", "left")),
    "no-identify": ("CODEC003", TYPE.replace("  set_speed", "  identify: true\n  set_speed"), CODEC),
    "no-actuator": ("CODEC003", TYPE + "actuators: {lamp: {channels: [lamp], max: 1}}\n", CODEC),
    "actuator-with-a-request": (
        "SPEC003",
        TYPE + 'actuators: {lamp: {send: "L,{value}", channels: [lamp], max: 1}}\n',
        CODEC + "    def actuator(self, actuator, index, values): ...\n",
    ),
}


@pytest.fixture
def garden(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robots").mkdir()
    (tmp_path / "swarm.yaml").write_text(SPEC)
    (tmp_path / "robots/snail.yaml").write_text(TYPE)
    (tmp_path / "robots/snail.py").write_text(CODEC)
    return tmp_path


def test_a_class_that_fits_is_fine_and_is_not_run(garden: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["validate", "swarm.yaml"]) == exit_codes.OK, capsys.readouterr().err
    assert load_catalog(garden / "robots").codecs == {"snail": CODEC.encode()}


@pytest.mark.parametrize("name", WRONG)
def test_an_error_is_reported_with_its_place(
    name: str, garden: Path, golden: Callable[[Path, str], None], capsys: pytest.CaptureFixture[str]
) -> None:
    rule, type_text, codec = WRONG[name]
    (garden / "robots/snail.yaml").write_text(type_text)
    if codec is None:
        (garden / "robots/snail.py").unlink()
    else:
        (garden / "robots/snail.py").write_text(codec)
    assert run(["validate", "swarm.yaml"]) == exit_codes.ERROR
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith(f"error[{rule}]")
    golden(GOLDEN / f"{name}.txt", printed.err.replace(str(garden), "."))


@pytest.mark.parametrize(
    "more",
    ["(Base)", "(Base, metaclass=Meta)"],
)
def test_methods_of_a_base_class_are_not_required(garden: Path, more: str) -> None:
    (garden / "robots/snail.py").write_text(f"from base import Base\nclass SnailCodec{more}: ...\n")
    assert run(["validate", "swarm.yaml"]) == exit_codes.OK


def test_a_type_within_a_spec_has_no_file_to_stand_beside(
    garden: Path, golden: Callable[[Path, str], None], capsys: pytest.CaptureFixture[str]
) -> None:
    (garden / "robots/snail.yaml").unlink()
    inline = "".join(f"    {line}\n" for line in TYPE.splitlines())
    (garden / "swarm.yaml").write_text(f"{SPEC}types:\n  snail:\n{inline}")
    assert run(["validate", "swarm.yaml"]) == exit_codes.ERROR
    golden(GOLDEN / "inline.txt", capsys.readouterr().err)


def test_its_file_is_in_the_bundle_of_the_hosts_that_need_it(garden: Path) -> None:
    assert run(["render", "swarm.yaml", "--out", "out"]) == exit_codes.OK
    assert (garden / "out/pi/codecs/snail.py").read_text() == CODEC
    assert "module: ../codecs/snail.py" in (garden / "out/pi/params/sid.yaml").read_text()
    assert "codecs/snail.py" in (garden / "out/pi/manifest.json").read_text()
