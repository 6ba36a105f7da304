"""An error in the file of a robot type is reported once, without errors that nobody made."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.loading import load_swarm

SPEC = """\
version: 1
name: garden
mode: single-minded
leader: pi
hosts:
  pi: {address: 192.168.77.40, computer: raspberry-pi-4b}
robots:
  benny: {type: beetle}
links:
  - {kind: serial, host: pi, robot: benny, usb: {serial: BEETLE1}}
"""
BEETLE = """\
title: Beetle
link: {kinds: [serial], baud: 115200}
kinematics:
  wheel_separation: 0.08
  wheel_speed_max: 0.25
  counter_bits: 16
  scales: [{speed_units_per_mps: 1000, metres_per_count: 0.0005}]
protocol:
  kind: line
  set_speed: {send: "S,{left},{right}", reply: s}
  queries:
    position: {send: P, reply: p, values: 2}
    accel: {send: A, reply: a, values: 3}
    volts: {send: V, reply: v, values: 1}
sensors:
  odom: {kind: wheels, read: position}
  accel: {kind: imu, rate: 2, acceleration: {scale: [0.01, 0.01, 0.01]}}
  volts: {kind: battery, rate: 1, volts: [0.001], empty: 6.6, full: 8.4}
firmware_dead_man: false
"""


@pytest.mark.parametrize(
    ("right", "wrong", "message"),
    [
        pytest.param("empty: 6.6", "empty: 9", "`empty` must be below `full`", id="two values of a sensor"),
        pytest.param("[0.01, 0.01, 0.01]", "[0.01]", "`scale` has too few entries", id="short list"),
        pytest.param("0.08", "0,08", "`wheel_separation`: `0,08` has a comma", id="decimal comma"),
        pytest.param("0.08", "-0.08", "`wheel_separation` cannot be `-0.08`", id="negative length"),
    ],
)
def test_one_error_is_one_finding(tmp_path: Path, right: str, wrong: str, message: str) -> None:
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots/beetle.yaml").write_text(BEETLE.replace(right, wrong))
    spec = tmp_path / "swarm.yaml"
    spec.write_text(SPEC)
    _, found = load_swarm(spec)
    assert [one.message for one in found] == [message]


def test_the_type_itself_is_valid(tmp_path: Path) -> None:
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots/beetle.yaml").write_text(BEETLE)
    spec = tmp_path / "swarm.yaml"
    spec.write_text(SPEC)
    _, found = load_swarm(spec)
    assert list(found) == []
