"""``swarmctl driver list`` and ``show``: what there is, what is beside a spec, and what is wrong with it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.spec.catalog import load_catalog
from swarmctl.views.escape import printable

GOLDEN = Path(__file__).parent / "golden/driver"
BEETLE = """\
title: Beetle
link: {kinds: [serial], baud: 115200, hint: is it asleep?}
kinematics:
  wheel_separation: 0.08
  wheel_radius: 0.02
  wheel_speed_max: 0.25
  counter_bits: 16
  scales: [{speed_units_per_mps: 1000, metres_per_count: 0.0005}]
protocol:
  kind: line
  set_speed: {send: "S,{left},{right}", reply: s}
  identify: {send: B, reply: b}
  queries:
    position: {send: P, reply: p, values: 2}
    eyes: {send: E, reply: e, values: 2}
sensors:
  odom: {kind: wheels, read: position}
  eyes:
    kind: range
    rate: 5
    max_reading: 255
    distances: [[10, 0.3], [255, 0.0]]
    field_of_view_deg: 20
    elements:
      - {name: left, x: 0.04, y: 0.02, heading_deg: 20}
      - {name: right, x: 0.04, y: -0.02, heading_deg: -20}
actuators:
  lamp: {send: "L,{value}", reply: l, channels: [lamp], max: 1}
firmware_dead_man: false
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of a spec with a type of its own."""
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots/beetle.yaml").write_text(BEETLE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_list_has_what_is_shipped_and_what_is_beside_the_spec(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["driver", "list", "--json"]) == exit_codes.OK
    types = {one["type"]: one for one in json.loads(capsys.readouterr().out)["types"]}
    assert set(types) == {*load_catalog().types, "beetle"}
    assert types["koala"]["from"] == "swarmctl"
    assert types["beetle"] == {
        "type": "beetle", "title": "Beetle", "protocol": "line", "links": ["serial"],
        "senses": ["odom", "eyes"], "from": "robots/beetle.yaml",
    }  # fmt: skip
    assert run(["driver", "list"]) == exit_codes.OK
    lines = capsys.readouterr().out.splitlines()
    assert {line.split()[0] for line in lines[1:] if not line.startswith(" ")} == set(types)


def test_a_page_shows_everything(
    folder: Path, capsys: pytest.CaptureFixture[str], golden: Callable[[Path, str], None]
) -> None:
    assert run(["driver", "show", "beetle"]) == exit_codes.OK
    golden(GOLDEN / "beetle.txt", capsys.readouterr().out)
    assert run(["driver", "show", "beetle", "--json"]) == exit_codes.OK
    output = json.loads(capsys.readouterr().out)
    assert output.pop("definition")["title"] == "Beetle"
    golden(GOLDEN / "beetle.json", json.dumps(output, indent=2) + "\n")


@pytest.mark.parametrize("name", sorted(load_catalog().types))
def test_every_shipped_type_has_a_page(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["driver", "show", name]) == exit_codes.OK
    shown = capsys.readouterr().out
    assert shown.startswith(f"{name}: ")
    kind = load_catalog().types[name]
    if isinstance(kind, RosRobotType):
        assert all(printable(str(value)) in shown for driver in kind.drivers for _, value in driver.texts)
        return
    assert all(topic in shown for topic in ("cmd_vel", "/diagnostics") if name != "arduino-rover")
    subscribed = shown.partition("\nSubscribes\n")[2]
    assert all(f"\n  {light} " in subscribed for light in kind.actuators)


def test_a_type_that_is_not_there(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["driver", "show", "beetel"]) == exit_codes.USAGE
    assert "did you mean `beetle`?" in capsys.readouterr().err


def test_a_wrong_file_is_an_error_and_hides_no_other(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "robots/bug.yaml").write_text(BEETLE.replace("title", "titel"))
    assert run(["driver", "show", "bug"]) == exit_codes.ERROR
    assert "robots/bug.yaml:1:1" in capsys.readouterr().err
    assert run(["driver", "list"]) == exit_codes.ERROR
    output = capsys.readouterr()
    assert "beetle" in output.out
    assert "did you mean `title`" in output.err
    assert run(["driver", "show", "beetle"]) == exit_codes.OK
