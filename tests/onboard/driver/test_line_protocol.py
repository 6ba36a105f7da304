"""Requests and replies as lines: what the robots of the manuals say, and whatever else may arrive."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.driver.codec import BadReplyError, Reply
from swarm_onboard.driver.line_protocol import LineBuffer, LineCodec, firmware_version, understand
from swarm_onboard.driver.protocols import LineQuery as Query

from tests.onboard.driver.fakes import config_for

POSITION = Query("H", "h", values=2)
PROXIMITY = Query("N", "n", values=11, extra=1)
SPEED = Query("D,{left},{right}", "d")


@pytest.mark.parametrize(
    ("type_name", "request_line"),
    [("koala", b"D,-100,100\n"), ("khepera3", b"D,l-100,l100\r"), ("epuck", b"D,-100,100\r")],
)
def test_a_speed_is_sent_in_the_format_of_the_robot(type_name, request_line):
    assert LineCodec(config_for(type_name).protocol).speed(-100, 100).data == request_line


@pytest.mark.parametrize(
    ("line", "query", "reply"),
    [
        (b"d", SPEED, Reply((), "")),
        (b"h,-5,70000", POSITION, Reply((-5, 70000), "-5,70000")),
        (b"h,18446744073709551615,0", POSITION, Reply((2**64 - 1, 0), "18446744073709551615,0")),
        (b"h, -5 ,+7", POSITION, Reply((-5, 7), " -5 ,+7")),
        (b"n," + b",".join([b"1"] * 12), PROXIMITY, Reply((1,) * 11, ",".join("1" * 12))),
        (
            b"v,Version 1.2.2 August 2008 GCtronic",
            Query("V", "v"),
            Reply((), "Version 1.2.2 August 2008 GCtronic"),
        ),
    ],
)
def test_a_good_reply_is_understood(line, query, reply):
    assert understand(line, query, ("z", "$")) == reply


@pytest.mark.parametrize(
    ("separator", "line"),
    [
        (" ", b"h -5  7 "),
        ("\t", b"h\t-5\t7"),
        (";", b"h;-5;7"),
        (", ", b"h, -5,7"),
        (":", b"h:-5:7"),
        ("|", b"h | -5|7"),
    ],
)
def test_any_separator_stands_between_head_and_numbers(separator, line):
    assert understand(line, POSITION, ("z", "$"), separator).values == (-5, 7)


def test_values_of_an_actuator_are_separated_alike():
    protocol = dataclasses.replace(config_for("koala").protocol, separator=" ")
    lights = SimpleNamespace(send="L {values}", reply="l")
    assert LineCodec(protocol).actuator(lights, 0, (1, 0, 1)).data == b"L 1 0 1\n"


@pytest.mark.parametrize(
    "line", [b"z,Protocol error", b"$", b"h,1", b"h,1,2,3", b"h,1,x", b"h,,", b"h", b"h,1_0,2", b"h,1,2.5"]
)
def test_a_bad_reply_is_rejected(line):
    with pytest.raises(BadReplyError):
        understand(line, POSITION, ("z", "$"))


@pytest.mark.parametrize(
    "line", [b"WELCOME to the SerCom protocol", b"d", b"hello", b"\xff\xfeh,1,2", b"HW version: 3"]
)
def test_noise_is_passed_over(line):
    assert understand(line, POSITION, ("z", "$")) is None


def test_z_is_a_good_answer_where_the_robot_uses_it_as_one():
    assert understand(b"z", Query("Z", "z"), ("z",)) == Reply((), "")


@given(pieces=st.lists(st.binary(max_size=700), max_size=20))
def test_no_stream_of_bytes_upsets_the_parser(pieces):
    buffer = LineBuffer()
    for piece in pieces:
        for line in buffer.feed(piece):
            assert line
            assert b"\r" not in line
            assert b"\n" not in line
            try:
                reply = understand(line, POSITION, ("z", "$"))
            except BadReplyError:
                continue
            assert reply is None or len(reply.values) == 2


@given(noise=st.binary(max_size=400), cut=st.integers(0, 12), end=st.sampled_from([b"\r\n", b"\n", b"\r"]))
def test_a_reply_is_found_behind_any_noise_and_in_any_pieces(noise, cut, end):
    buffer, stream = LineBuffer(), noise + end + b"h,-12,345" + end
    lines = (
        [line for part in (stream[:-cut], stream[-cut:]) for line in buffer.feed(part)]
        if cut
        else buffer.feed(stream)
    )
    assert lines[-1] == b"h,-12,345"


def test_an_endless_line_is_not_kept():
    buffer = LineBuffer()
    for _ in range(1000):
        assert buffer.feed(b"x" * 1000) == []
    assert len(buffer.feed(b"\n")[0]) <= 512


@pytest.mark.parametrize(
    ("text", "version"),
    [
        ("2,1", 2.0),
        ("3.05,1", 3.05),
        ("Version 1.2.2 August 2008 GCtronic", 1.2),
        ("A-02", 2.0),
        ("", None),
        ("unknown", None),
    ],
)
def test_the_firmware_version_is_the_first_number(text, version):
    assert firmware_version(text) == version
