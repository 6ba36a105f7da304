"""Doubts about robot types are shown where their text is, and can be ignored there."""

from __future__ import annotations

from pathlib import Path

from swarmctl.diagnostics import Diagnostic
from swarmctl.rulebook import example
from tests.loading import load_checked

TYPE = """\
title: Beetle
link: {kinds: [serial], baud: 115200}
kinematics:
  wheel_separation: 0.29
  wheel_radius: 0.0125
  wheel_speed_max: 0.45
  scales: [{speed_units_per_mps: 222.2, metres_per_count: 4.5e-5}]
protocol:
  kind: line
  set_speed: {send: "D,{left},{right}", reply: d}
  queries:
    position: {send: P, reply: p, values: 2}
sensors:
  odom: {kind: wheels, read: position}
firmware_dead_man: true
"""


def found(folder: Path, type_: str = TYPE, more: str = "", robot: str = "") -> tuple[Diagnostic, ...]:
    """The findings in a spec with a type in a file of its own."""
    (folder / "robots").mkdir()
    (folder / "robots/beetle.yaml").write_text(type_)
    text = example().replace("koala: {type: koala,", f"koala: {{type: beetle, {robot}") + more
    (folder / "swarm.yaml").write_text(text)
    return load_checked(folder / "swarm.yaml")[1]


def test_a_doubt_is_shown_in_the_file_of_the_type(tmp_path: Path) -> None:
    (one,) = found(tmp_path)
    assert one.code == "SENSE002"
    assert one.span is not None
    assert (Path(one.span.file).name, one.span.line, one.span.column) == ("beetle.yaml", 4, 21)


def test_a_comment_in_the_file_of_the_type_ignores_it(tmp_path: Path) -> None:
    comment = "0.29   # swarmctl: ignore SENSE002 measured on the robot"
    assert found(tmp_path, TYPE.replace("0.29", comment)) == ()


def test_a_comment_in_the_file_of_a_type_needs_an_effect(tmp_path: Path) -> None:
    comment = "0.0425   # swarmctl: ignore SENSE002 measured on the robot"
    (one,) = found(tmp_path, TYPE.replace("0.0125", comment))
    assert one.code == "SIL001"


def test_the_spec_ignores_it_by_the_types_name(tmp_path: Path) -> None:
    more = "ignore: [{rule: SENSE002, about: beetle, reason: measured on the robot}]\n"
    assert found(tmp_path, more=more) == ()


def test_a_rate_of_one_robot_makes_its_counters_ambiguous(tmp_path: Path) -> None:
    type_ = TYPE.replace("0.0125", "0.0425").replace("  scales", "  counter_bits: 14\n  scales")
    (one,) = found(tmp_path, type_, robot="settings: {rates: {odom: 1}},")
    assert (one.code, "robot `koala`" in one.message) == ("SENSE007", True)


def test_limits_of_a_type_above_its_wheels_are_reported_in_its_file(tmp_path: Path) -> None:
    type_ = TYPE.replace("0.0125", "0.0425") + "settings: {limits: {linear: 4.5}}\n"
    (one,) = found(tmp_path, type_)
    assert one.code == "SET001"
    assert one.span is not None
    assert Path(one.span.file).name == "beetle.yaml"


def test_limits_of_all_robots_are_compared_with_the_fastest(tmp_path: Path) -> None:
    type_ = TYPE.replace("0.0125", "0.0425")
    (one,) = found(tmp_path, type_, more="defaults: {robot: {limits: {linear: 0.46}}}\n")
    assert (one.code, "every robot" in one.message) == ("SET001", True)
