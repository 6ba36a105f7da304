"""Placeholders in the texts of a ROS driver."""

from __future__ import annotations

import pytest

from swarmctl.field_types import Value
from swarmctl.robot_types.ros_launchable import PlaceholderError, filled, meanings, placeholders_in

VALUES = {"namespace": "tb3_01", "baud": 57600, "device": "/dev/swarm/tb3-01"}


@pytest.mark.parametrize(
    ("text", "made"),
    [
        ("{namespace}", "tb3_01"),
        ("{namespace}/odom", "tb3_01/odom"),
        ("{device}:{baud}", "/dev/swarm/tb3-01:57600"),
        ("{baud}", 57600),
        ("{{baud}", "{baud}"),
        ("{{}}", "{}"),
        ("a}", "a}"),
        ("", ""),
        (0.5, 0.5),
        (True, True),
    ],
)
def test_a_text_is_filled_in(text: Value, made: Value) -> None:
    assert filled(text, VALUES) == made
    assert type(filled(text, VALUES)) is type(made)


@pytest.mark.parametrize("text", ["{host}", "{", "{}", "{Baud}", "x{ baud }"])
def test_an_unknown_placeholder_names_the_known_ones(text: str) -> None:
    with pytest.raises(PlaceholderError, match=r"\{namespace\}, \{baud\}, \{device\}, or `\{\{` for a brace"):
        filled(text, VALUES)


def test_every_placeholder_is_found() -> None:
    assert list(placeholders_in("{robot}-{{x}}-{uri} {")) == ["robot", "uri", ""]
    assert set(VALUES) < set(meanings())
