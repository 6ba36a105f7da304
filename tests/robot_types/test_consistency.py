"""What does not fit together in a robot type: the finding points at the key to look at, never at the file."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from pathlib import Path
from textwrap import indent

import pytest

from swarmctl.robot_types.robot_type import RobotType
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.validation import validated
from swarmctl.yamltext.source import parse
from tests import ROOT
from tests.loading import lint_files
from tests.robot_types.test_hostile_types import BYTES, DEAD_MAN, LINE, actuator

PYTHON = (
    LINE.replace("kind: line", "kind: python\n  codec: SnailCodec")
    .replace('{send: "D,{left},{right}", reply: d}', "{request: 8, reply: 4}")
    .replace("{send: R, reply: r, values: 2}", "{request: 8, reply: 4, values: 2}")
)
SKETCH = """\
title: Cart
link: {kinds: [serial], baud: 57600}
kinematics:
  wheel_separation: 0.2
  wheel_radius: 0.03
  wheel_speed_max: 0.5
protocol:
  kind: rosserial
  board: arduino-uno
  firmware_timeout: 0.4
  firmware: uno-l298n
  publishes:
    - {topic: lwheel, type: std_msgs/Int32, rate: 20}
    - {topic: rwheel, type: std_msgs/Int32, rate: 20}
  subscribes:
    - {topic: cmd_vel, type: geometry_msgs/Twist}
  odometry: {left: lwheel, right: rwheel, counts_per_turn: 20}
firmware_dead_man: true
"""
POSITION = "position: {send: R, reply: r, values: 2}"
CLASS = """\
class SnailCodec:
    def __init__(self, options): pass
    def speed(self, left, right): pass
    def query(self, name): pass
"""
ODOM = "odom: {kind: wheels, read: position}"
IMU = (
    "accelerometer: {kind: imu, read: position, rate: 5, acceleration: {order: [0, 1, 1], scale: [1, 1, 1]}}"
)
_MORE = {"speed": "e", "proximity": "p", "light": "o"}
QUERIES = LINE.replace(
    POSITION,
    POSITION
    + "".join(f"\n    {one}: {{send: {key.upper()}, reply: {key}, values: 1}}" for one, key in _MORE.items()),
).replace(ODOM, ODOM + "".join(f"\n  {one}: {{kind: raw, rate: 5, names: [x]}}" for one in _MORE))
SCALE = "{speed_units_per_mps: 1000, metres_per_count: 0.0005}"
RATE = (DEAD_MAN, f"settings: {{rates: {{nothing: 5}}}}\n{DEAD_MAN}")
OLDER = "{firmware_below: 3, speed_units_per_mps: 10, metres_per_count: 0.0005}"


def added(text: str) -> str:
    return f"{text}\n{DEAD_MAN}"


CONTRADICTIONS = [
    (LINE, ("max: 0.25", "max: 0.25\n  wheel_speed_min: 0.3"), "must be below", "0.3"),
    (LINE, (f"[{SCALE}]", f"[{SCALE}, {OLDER}]"), "from old firmware to new", f"[{SCALE}, {OLDER}]"),
    (LINE, (f"  scales: [{SCALE}]\n", ""), "add `kinematics.scales`", "kinematics"),
    (LINE, (f"[{SCALE}]", f"[{OLDER}, {SCALE}]"), "must request the firmware version", "protocol"),
    (
        LINE,
        (ODOM, ODOM + "\n  cmd_vel: {kind: raw, read: position, rate: 5, names: [a]}"),
        "is taken",
        "cmd_vel",
    ),
    (
        LINE,
        (DEAD_MAN, actuator('max: 1, send: "L,{index},{value}"').replace("lamps", "odom")),
        "is taken",
        "odom",
    ),
    (LINE, (ODOM, "wheels: {kind: wheels, read: position}"), "are called `odom`", "wheels"),
    (
        LINE,
        (ODOM, ODOM + "\n  light: {kind: raw, read: position, rate: 5, names: [a, a]}"),
        "two of them are called `a`",
        "[a, a]",
    ),
    (
        LINE,
        (DEAD_MAN, actuator('max: 1, send: "L,{index},{value}"').replace("left, right", "b, b")),
        "two of them are called `b`",
        "[b, b]",
    ),
    (LINE, ("read: position", "read: positions"), "none of the `queries`", "positions"),
    (LINE, ("read: position}", "read: position, first: 1}"), "takes 2 from number 1", "1"),
    (
        LINE,
        (POSITION, POSITION + "\n    light: {send: T, reply: t, values: 1}"),
        "no sensor reads",
        "light",
    ),
    (QUERIES, ("send: E,", "send: R,"), "`position` and `speed` send one request, `R`", "R"),
    (
        QUERIES.replace("kind: line", "kind: binary")
        .replace('"D,{left},{right}", reply: d', '"bc {left:h} {right:h}", reply: b')
        .replace("send: R, reply: r, values: 2", 'send: "af 00", reply: 2h')
        .replace("send: E, reply: e, values: 1", 'send: "af 01", reply: h')
        .replace("send: P, reply: p, values: 1", 'send: "af 02", reply: h')
        .replace("send: O, reply: o, values: 1", 'send: "af 03", reply: h'),
        ('"af 01"', '"af  00"'),
        "send one request",
        '"af  00"',
    ),
    (QUERIES, ("reply: o,", "reply: p,"), "as that to `proximity`", "p"),
    (
        LINE,
        ("values: 2}", "values: 2, pattern: '([a-z]+),([0-9]+)'}"),
        "can never be a number",
        "'([a-z]+),([0-9]+)'",
    ),
    (SKETCH, ("right: rwheel", "right: lwheel"), "counts for both wheels", "lwheel"),
    (LINE, (DEAD_MAN, actuator("max: 1")), "is missing; ", "lamps"),
    (
        LINE,
        (DEAD_MAN, actuator('max: 1, send: "{index:B} {value:B}"')),
        "not written for",
        '"{index:B} {value:B}"',
    ),
    (
        PYTHON,
        (DEAD_MAN, actuator('max: 1, send: "L,{index},{value}"')),
        "remove `send`",
        '"L,{index},{value}"',
    ),
    (BYTES, ("mps: 1000,", "mps: 131073,"), "units of speed", "0.25"),
    (LINE, (DEAD_MAN, added("settings: {rates: {light: 5}}")), "have a rate for `light`", "light"),
    (LINE, ("D,{left},{right}", "D,{left}"), "needs {left} and {right}", '"D,{left}"'),
    (BYTES, ("bc {left:h} {right:h}", "bc {left:h}"), "needs {left:h}", '"bc {left:h}"'),
    (BYTES, ("reply: b}", "reply: b, echo: true}"), "an echo has two values", "b"),
    (BYTES, ('"af 00"', '"af {index:b}"'), "nothing fills", '"af {index:b}"'),
    (
        LINE,
        ("values: 2}", "values: 2, pattern: '([0-9]+)'}"),
        "groups, one for each of `values`",
        "'([0-9]+)'",
    ),
    (LINE, (DEAD_MAN, actuator('max: 1, send: "L,{index}"')), "needs {value}", '"L,{index}"'),
    (BYTES, (DEAD_MAN, actuator('max: 200, send: "b4 {index:b} {value:b}"')), "holds 127 at most", "200"),
    (
        LINE,
        (DEAD_MAN, actuator('max: 1, send: "L{index},{value}", reply: "l,1"')),
        "first separator",
        '"l,1"',
    ),
    (LINE, (ODOM, f"{ODOM}\n  {IMU}"), "names each of 0, 1 and 2", "[0, 1, 1]"),
    (
        LINE,
        (
            ODOM,
            ODOM + "\n  battery: {kind: battery, read: position, rate: 1, volts: [1], empty: 9, full: 8}",
        ),
        "below",
        "9",
    ),
    (LINE, (DEAD_MAN, added("settings: {battery: {low: 0.2, empty: 0.1}}")), "of kind `battery`", "battery"),
    (
        LINE,
        (DEAD_MAN, added("settings: {battery: {low: 0.2, empty: 0.3}}")),
        "`empty` must be below `low`",
        "0.3",
    ),
    (SKETCH, (DEAD_MAN, added("settings: {battery: {low: 0.2, empty: 0.1}}")), "of a sketch", "battery"),
    (SKETCH, ("  wheel_radius: 0.03\n", ""), "add `kinematics.wheel_radius`", "kinematics"),
    (SKETCH, ("max: 0.5", f"max: 0.5\n  scales: [{SCALE}]"), "takes commands in m/s", "scales"),
    (SKETCH, (DEAD_MAN, added(f"sensors: {{{ODOM}}}")), "are under `protocol`", "sensors"),
    (SKETCH, (f"{DEAD_MAN}: true", f"{DEAD_MAN}: false"), "build a dead-man into it", "false"),
    (
        SKETCH,
        (DEAD_MAN, added("settings: {firmware: {left: {forward: 4, backward: 4}}}")),
        "has two uses",
        "4",
    ),
    (SKETCH, ("topic: rwheel", "topic: r/wheel"), "within a robot's namespace", "r/wheel"),
    (
        SKETCH,
        ("Int32, rate: 20}\n    - {topic: rwheel", "Int32}\n    - {topic: rwheel"),
        "how often",
        "{topic: lwheel, type: std_msgs/Int32}",
    ),
    (
        SKETCH,
        ("  subscribes:\n    - {topic: cmd_vel,", "  subscribes:\n    - {topic: orders,"),
        "`subscribes` has no `cmd_vel`",
        "subscribes",
    ),
    (SKETCH, ("arduino-uno", "arduino-mega"), "is for arduino-uno", "arduino-mega"),
    (
        SKETCH,
        ("rwheel, type: std_msgs/Int32", "rwheel, type: std_msgs/Int16"),
        "two std_msgs/Int32",
        "publishes",
    ),
    (
        SKETCH,
        ("rwheel, type: std_msgs/Int32, rate: 20", "rwheel, type: std_msgs/Int32, rate: 10"),
        "at one rate",
        "10",
    ),
    (SKETCH, ("right: rwheel", "right: wheel"), "counts on `wheel`", "wheel"),
]


@pytest.mark.parametrize(("text", "change", "message", "pointed_at"), CONTRADICTIONS)
def test_a_contradiction_is_shown_where_it_is(
    tmp_path: Path, text: str, change: tuple[str, str], message: str, pointed_at: str
) -> None:
    file = tmp_path / "snail.yaml"
    (tmp_path / "snail.py").write_text(CLASS)
    file.write_text(text)
    assert load_catalog(tmp_path).diagnostics == ()
    assert change[0] in text
    broken = text.replace(*change)
    file.write_text(broken)
    [found] = load_catalog(tmp_path).diagnostics
    assert message in "; ".join((found.message, *found.help))
    line = broken.splitlines()[found.span.line - 1]
    assert line[found.span.column - 1 : found.span.end_column - 1] == pointed_at


def messages(text: str) -> frozenset[str]:
    """What is found in a robot type, without a class beside it."""
    source, _ = parse(text, "snail.yaml")
    return frozenset(one.message for one in validated(RobotType, source)[1])


@pytest.mark.parametrize(
    ("changes", "shown"),
    [
        (((POSITION, POSITION + "\n    idle: {send: I, reply: i, values: 1}"), RATE), ("idle", "`nothing`")),
        ((("max: 0.25", "max: 0.25\n  wheel_speed_min: 0.3"), RATE), ("must be below", "`nothing`")),
        (
            (("max: 0.25", "max: 0.25\n  wheel_speed_min: 0.3"), (f"[{SCALE}]", f"[{OLDER}, {OLDER}]")),
            ("must be below", "from old firmware to new"),
        ),
        ((("read: position", "read: positon"), RATE), ("`positon`", "`nothing`")),
    ],
    ids=["whole", "part-and-whole", "part", "no-idle-query"],
)
def test_contradictions_show_together(changes: tuple[tuple[str, str], ...], shown: tuple[str, ...]) -> None:
    text = LINE
    for change in changes:
        assert change[0] in text
        text = text.replace(*change)
    found = messages(text)
    assert len(found) == len(shown)
    assert all(any(one in message for message in found) for one in shown)


def test_two_contradictions_cause_no_third(note: Callable[[str, str, str], None]) -> None:
    """Of all pairs of those above, three of four findings are there together; none is new."""
    wanted = shown = 0
    for (text, one, *_), (other_text, other, *_) in combinations(CONTRADICTIONS, 2):
        both = text.replace(*one).replace(*other)
        if other_text != text or other[0] not in text.replace(*one) or one[1] not in both:
            continue
        alone = messages(text.replace(*one)) | messages(text.replace(*other))
        together = messages(both)
        assert together
        assert together <= alone, (one, other)
        wanted += len(alone)
        shown += len(together)
    note("contradictions of two parts: shown", f"{shown / wanted:.0%} of {wanted}", "75 %")
    assert shown >= 0.75 * wanted


def test_contradictions_within_a_spec_show_together() -> None:
    spec = (ROOT / "examples/paper-leader/swarm.yaml").read_text("utf-8")
    wrong = LINE.replace("max: 0.25", "max: 0.25\n  wheel_speed_min: 0.3").replace(*RATE)
    text = f"{spec}types:\n  snail:\n{indent(wrong, '    ')}"
    found = lint_files([Path("swarm.yaml")], lambda _: text.encode()).diagnostics
    assert sorted(one.code for one in found) == ["SPEC003", "SPEC003"]
