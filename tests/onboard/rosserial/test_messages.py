"""Messages that rosserial itself needs: lengths are checked, parameters become what a board can read."""

from __future__ import annotations

import contextlib
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.rosserial import messages
from swarm_onboard.rosserial.messages import BadMessageError, Log, TopicInfo

from tests.onboard.rosserial.fakes import text


def lists(ints: list[int], floats: list[float], texts: list[str]) -> bytes:
    data = struct.pack(f"<I{len(ints)}i", len(ints), *ints) + struct.pack(
        f"<I{len(floats)}f", len(floats), *floats
    )
    return data + struct.pack("<I", len(texts)) + b"".join(map(text, texts))


@pytest.mark.parametrize(
    ("value", "answer"),
    [
        (7, lists([7], [], [])),
        (True, lists([1], [], [])),
        (0.5, lists([], [0.5], [])),
        ("grün", lists([], [], ["grün"])),
        ([1, -2], lists([1, -2], [], [])),
        ([True, False], lists([1, 0], [], [])),
        ([1.5, 2.5], lists([], [1.5, 2.5], [])),
        (["a", ""], lists([], [], ["a", ""])),
        ([], lists([], [], [])),
    ],
)
def test_a_parameter_becomes_lists(value, answer):
    assert messages.parameter(value) == answer


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        ({"a": 1}, "only whole numbers, floats, texts"),
        (None, "only whole numbers, floats, texts"),
        ([[1]], "only whole numbers, floats, texts"),
        ([1, 2.0], "lists of one kind"),
        ([1, "a"], "lists of one kind"),
        (1 << 31, "32 bits"),
        (1e39, "hold no 1e\\+39"),
    ],
)
def test_unsupported_parameter_values_are_rejected(value, reason):
    with pytest.raises(BadMessageError, match=reason):
        messages.parameter(value)


@given(st.binary(max_size=80))
def test_any_bytes_are_a_message_or_rejected(data):
    with contextlib.suppress(BadMessageError):
        TopicInfo.decode(data)
    with contextlib.suppress(BadMessageError):
        Log.decode(data)
    with contextlib.suppress(BadMessageError):
        messages.parameter_name(data)
    with contextlib.suppress(BadMessageError):
        messages.integer("std_msgs/Int16", data)


@pytest.mark.parametrize("length", [0, 1, 3, 5])
def test_a_number_of_another_length_is_none(length):
    with pytest.raises(BadMessageError):
        messages.integer("std_msgs/Int32", bytes(length))
