"""Which parameters a node of ROS 1 and of ROS 2 can have, and what is wrong with the others."""

from __future__ import annotations

import math
from typing import Any

import pytest

from swarmctl.ros_packages.parameters import ParameterFileError, Reader, read_file, refusals

RCL, ROSPARAM = "rcl", "rosparam"
#: A value, what refuses it, and where and why; the rest takes it.
VALUES: tuple[tuple[Any, Reader, str], ...] = (
    ([1, "two"], RCL, "a/1: a list of ROS 2 has items of one type: here are numbers and texts"),
    ([True, 1], RCL, "a/1: a list of ROS 2 has items of one type: here are true or false and numbers"),
    ([[0, 1], [2, 3]], RCL, "a/0: a list in a list is no parameter of ROS 2"),
    ([[0]], RCL, "a/0: a list in a list is no parameter of ROS 2"),
    ([{"b": 1}], RCL, "a/0: a mapping in a list is no parameter of ROS 2"),
    ([], RCL, "a: an empty list has no type, and ROS 2 refuses it"),
    (1 << 63, RCL, "a: 9223372036854775808 does not fit into the 64 bits of a whole number in ROS 2"),
    ({"b": [1, 1 << 63]}, RCL, "a/b/1: 9223372036854775808 does not fit into the 64 bits"),
    (5e-324, RCL, "a: 5e-324 is so small that rcl reads it as text"),
    (1 << 31, ROSPARAM, "a: 2147483648 does not fit into the 32 bits of a whole number in ROS 1"),
    ([{"b": -(1 << 31) - 1}], ROSPARAM, "a/0/b: -2147483649 does not fit into the 32 bits"),
    ({"": 1}, RCL, "a/: `` is no name of a parameter"),
)


def messages(value: Any, reader: Reader) -> str:
    return "\n".join(
        f"{'/'.join(map(str, one.loc))}: {one.message}" for one in refusals({"a": value}, reader)
    )


@pytest.mark.parametrize(("value", "reader", "message"), VALUES, ids=[message for *_, message in VALUES])
def test_what_one_reader_does_not_take(value: Any, reader: Reader, message: str) -> None:
    assert messages(value, reader).startswith(message)
    if not messages(value, RCL) or not messages(value, ROSPARAM):
        assert reader == (RCL if messages(value, RCL) else ROSPARAM)


@pytest.mark.parametrize("value", [True, -1, 0.5, "y", [1, 0.5], ["a"], {"b": {"c": [False]}}, {}])
def test_what_both_take(value: Any) -> None:
    assert messages(value, RCL) == messages(value, ROSPARAM) == ""


@pytest.mark.parametrize(
    ("reader", "params"),
    [
        (RCL, {"a.b": 1, "a": {"b": 2}}),
        (ROSPARAM, {"a/b": 1, "a": {"b": 2}}),
        (RCL, {"a": {"b": 2}, "a.b": 1}),
    ],
)
def test_a_parameter_has_one_value(reader: Reader, params: Any) -> None:
    assert [one.message[5:] for one in refusals(params, reader)] == [" is given twice, and in two forms"]


#: A file, what reads it, and what is wrong with it where.
FILES: tuple[tuple[str, Reader, str], ...] = (
    ("a: [", RCL, "2:1: did not find expected node content"),
    ("[a]", ROSPARAM, "1:1: it is not a mapping"),
    ("a: " + "[" * 200_000, RCL, "1:67: it is nested in more than 64 levels"),
    ("a: !unknown x", ROSPARAM, "1:4: the tag `!unknown` is unknown"),
    ("a: !degrees x", RCL, "1:4: `x` is no angle"),
    ("a: null", ROSPARAM, "1:4: null is no parameter"),
    ("a: 2001-13-01", ROSPARAM, "1:1: a value cannot be read: month must be in 1..12"),
    ("a:\n  b: [1, x]", RCL, "2:10: a list of ROS 2 has items of one type"),
    ("/**:\n  ros__parameters: {a: !degrees 90}", RCL, "2:24: the tag `!degrees` is unknown"),
    ("/**:\n  ros__parameters: {a: &x 1, b: *x}", RCL, "2:33: rcl takes no aliases"),
    ("/**:\n  ros__parameters: {a: }", RCL, "2:24: there is no value"),
    ("/**:\n  ros__parameters: {a: {}}", RCL, "2:24: an empty mapping is none of rcl's values"),
    ("/**:\n  ros__parameters: {a: [y, x]}", RCL, "2:28: a list of ROS 2 has items of one type"),
    ("a b: {ros__parameters: {a: 1}}", RCL, "1:6: `a b` is no name of a node"),
    ("rate: 1\nscan: {ros__parameters: {a: 1}}", RCL, "1:7: a value that is not below a node"),
)


@pytest.mark.parametrize(("text", "reader", "message"), FILES, ids=[message for *_, message in FILES])
def test_what_is_wrong_with_a_file(text: str, reader: Reader, message: str) -> None:
    with pytest.raises(ParameterFileError) as caught:
        read_file(text.encode(), reader)
    assert f"{caught.value.line}:{caught.value.column}: {caught.value}".startswith(message)


def test_a_file_of_rosparam_has_angles() -> None:
    text = b"a: !degrees 90\nb: deg(180)\nc: rad(-pi/2)\nd: !radians 2*pi\ne: .inf\n"
    values = {"a": math.pi / 2, "b": math.pi, "c": -math.pi / 2, "d": 2 * math.pi, "e": math.inf}
    assert read_file(text, RCL).values == read_file(text, ROSPARAM).values == values
