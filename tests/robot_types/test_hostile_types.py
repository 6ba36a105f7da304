"""Type files that would hold up a robot, or end its driver: each is refused where it stands."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.robot_types.line_protocol import bounded
from swarmctl.spec.catalog import load_catalog
from tests.timing import work_at_most

LINE = """\
title: Snail
link: {kinds: [serial], baud: 115200}
kinematics:
  wheel_separation: 0.08
  wheel_speed_max: 0.25
  scales: [{speed_units_per_mps: 1000, metres_per_count: 0.0005}]
protocol:
  kind: line
  set_speed: {send: "D,{left},{right}", reply: d}
  queries:
    position: {send: R, reply: r, values: 2}
sensors:
  odom: {kind: wheels, read: position}
firmware_dead_man: false
"""
BYTES = (
    LINE.replace("kind: line", "kind: binary")
    .replace('send: "D,{left},{right}", reply: d', 'send: "bc {left:h} {right:h}", reply: b')
    .replace("send: R, reply: r, values: 2", 'send: "af 00", reply: 2h')
)
DEAD_MAN = "firmware_dead_man"


def actuator(fields: str) -> str:
    return f"actuators:\n  lamps: {{channels: [left, right], {fields}}}\n{DEAD_MAN}"


@pytest.mark.parametrize(
    ("text", "before", "after", "message"),
    [
        (BYTES, '"af 00"', '"af {index:b}"', "nothing fills `{index:b}` here"),
        (BYTES, "  queries", '  setup: [{send: "01 {left:h}", reply: b}]\n  queries', "nothing fills `{left"),
        (BYTES, "mps: 1000,", "mps: 131073,", "is 32768.2 units of speed, and `set_speed` holds"),
        (BYTES, "{left:h} {right:h}", "{left:H} {right:H}", "holds 0 to 65535"),
        (BYTES, DEAD_MAN, actuator('max: 128, send: "b4 {index:b} {value:b}"'), "holds 127 at most"),
        (BYTES, DEAD_MAN, actuator('max: 128, send: "b4 {values:b}"'), "holds 127 at most"),
        (LINE, DEAD_MAN, actuator('max: 1, send: "L{index},{value}", reply: "l,1"'), "its first separator"),
        (LINE, "wheel_separation: 0.08", "wheel_separation: 0.00001", "`wheel_separation` cannot be"),
        (LINE, "wheel_speed_max: 0.25", "wheel_speed_max: 1000", "`wheel_speed_max` cannot be"),
        (LINE, "mps: 1000,", "mps: 2000000000,", "`speed_units_per_mps` cannot be"),
        (LINE, "  queries", f"  setup: [{', '.join(['{send: C, reply: c}'] * 65)}]\n  queries", "`setup`"),
        (LINE, "values: 2}", "values: 2, pattern: '((?:[0-9]+)+),(.)'}", "more than a driver understands"),
        (LINE, "values: 2}", "values: 2, pattern: '(a{99999999999})(b)'}", "more than a driver understands"),
    ],
)  # fmt: skip
def test_it_is_refused_with_its_place(
    tmp_path: Path, text: str, before: str, after: str, message: str
) -> None:
    assert before in text
    (tmp_path / "snail.yaml").write_text(text)
    assert load_catalog(tmp_path).diagnostics == ()
    (tmp_path / "snail.yaml").write_text(text.replace(before, after))
    found, *_ = load_catalog(tmp_path).diagnostics
    assert message in found.message
    assert found.span.line > 0


def test_what_just_fits_is_taken(tmp_path: Path) -> None:
    just = BYTES.replace("mps: 1000,", "mps: 131068,").replace(
        DEAD_MAN, actuator('max: 255, send: "b4 {index:b} {value:B}"')
    )
    (tmp_path / "snail.yaml").write_text(just)
    assert load_catalog(tmp_path).diagnostics == ()


@pytest.mark.parametrize(
    "pattern",
    [
        "([0-9]+)",
        r"(-?[0-9]+)\.[0-9]{2} V, *([0-9]+)$",
        "[^,]*,([0-9]{3})([0-9]{3})",
        r"\((\d+)%\)",
        "T=(.*)",
    ],
)
def test_a_pattern_that_has_one_way_to_match_is_taken(pattern: str) -> None:
    assert bounded(pattern) == pattern


@pytest.mark.parametrize(
    "pattern",
    [
        "(a+)+b",
        "([0-9]*)([0-9]*)x",
        "(a?a?a)",
        ".*,(x)",
        "(a|b)",
        r"(a)\1",
        "(?=a)(a)",
        "(é)",
        "([[a])",
        "(",
        "(a",
    ],
)
def test_another_one_is_refused(pattern: str) -> None:
    with pytest.raises(ValueError, match="`"):
        bounded(pattern)


@given(
    pieces=st.lists(
        st.sampled_from(["a", "[ab]", "[^a]", ".", "b", "(", ")", "*", "+", "?", "{2,}", ","]), max_size=30
    )
)
def test_whatever_is_taken_is_matched_at_once(pieces: list[str]) -> None:
    try:
        pattern = re.compile(bounded("".join(pieces)))
    except ValueError:
        return
    with work_at_most(5):
        for line in ("a" * 512, "ab" * 256, "b" * 511 + ",", "ab," * 170):
            pattern.match(line)
