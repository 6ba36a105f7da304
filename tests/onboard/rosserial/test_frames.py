"""Frames of rosserial: the bytes that the real client sends and takes, and whatever else a line may bring."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.rosserial import messages
from swarm_onboard.rosserial.frames import LONGEST, REQUEST_TOPICS, TX_STOP, Frame, FrameReader, encode
from swarm_onboard.rosserial.messages import Log, TopicInfo

from tests.onboard.rosserial.fakes import framed

HEX = bytes.fromhex
LWHEEL = HEX("7d00 06000000") + b"lwheel" + HEX("0e000000") + b"std_msgs/Int32"
LWHEEL += HEX("20000000") + b"da5909fbe378aeaf85e547e830cc1bb7" + HEX("18010000")
CMD_VEL = HEX("6400 07000000") + b"cmd_vel" + HEX("13000000") + b"geometry_msgs/Twist"
CMD_VEL += HEX("20000000") + b"9f195f881246fdfa2798d1d3eebca84a" + HEX("18010000")

# Captured from rosserial's own node_handle.h (noetic), or parsed by it: bytes, topic id, message.
SAMPLES = {
    "request topics": (HEX("fffe0000ff0000ff"), 0, b""),
    "tx stop": (HEX("fffe0000ff0b00f4"), 11, b""),
    "time request": (HEX("fffe0800f70a000000000000000000f5"), 10, bytes(8)),
    "time reply": (HEX("fffe0800f70a0000f1536500 65cd1dfd"), 10, messages.time(1_700_000_000_500_000_000)),
    "publisher": (HEX("fffe4600b90000") + LWHEEL + HEX("35"), 0, LWHEEL),
    "subscriber": (HEX("fffe4c00b30100") + CMD_VEL + HEX("69"), 1, CMD_VEL),
    "Int32 1234": (HEX("fffe0400fb7d00d2040000ac"), 125, struct.pack("<i", 1234)),
    "Int32 -1": (HEX("fffe0400fb7e00ffffffff85"), 126, struct.pack("<i", -1)),
    "Int16 300": (HEX("fffe0200fd7d002c0155"), 125, struct.pack("<h", 300)),
    "Twist": (
        HEX("fffe3000cf64009a9999999999c93f") + bytes(32) + HEX("000000000000e0bf5d"),
        100,
        messages.twist(0.2, -0.5),
    ),
    "standstill": (HEX("fffe3000cf6400") + bytes(48) + HEX("9b"), 100, messages.twist(0.0, 0.0)),
    "log": (HEX("fffe0a00f507000105000000") + b"hello" + HEX("de"), 7, HEX("0105000000") + b"hello"),
    "parameter request": (HEX("fffe0800f7060004000000") + b"~foo" + HEX("33"), 6, HEX("04000000") + b"~foo"),
    "parameter reply": (
        HEX("fffe1000ef0600010000000700000000000000 00000000f1"),
        6,
        messages.parameter(7),
    ),
}
GOOD = encode(125, struct.pack("<i", 1234))
IT = Frame(125, struct.pack("<i", 1234))


@pytest.mark.parametrize(("data", "topic_id", "message"), SAMPLES.values(), ids=SAMPLES)
def test_the_bytes_are_those_of_the_real_client(data, topic_id, message):
    assert encode(topic_id, message).hex(" ") == data.hex(" ")
    assert FrameReader().feed(data) == [Frame(topic_id, message)]


def test_requests_without_a_message():
    assert SAMPLES["request topics"][0] == REQUEST_TOPICS
    assert SAMPLES["tx stop"][0] == TX_STOP


def test_frames_of_the_client_are_decoded():
    assert TopicInfo.decode(LWHEEL) == TopicInfo(
        125, "lwheel", "std_msgs/Int32", "da5909fbe378aeaf85e547e830cc1bb7", 280
    )
    assert Log.decode(SAMPLES["log"][2]) == Log(1, "hello")
    assert messages.parameter_name(SAMPLES["parameter request"][2]) == "~foo"
    assert messages.integer("std_msgs/Int32", SAMPLES["Int32 -1"][2]) == -1
    assert messages.integer("std_msgs/Int16", SAMPLES["Int16 300"][2]) == 300


@pytest.mark.parametrize(
    "stray", [b"\xff", b"\xff\xff", b"\xff\xfe\xff", b"\xff\xff\x00\xff", b"\x00", b"\xfe"]
)
def test_bytes_before_a_frame_do_not_lose_it(stray):
    assert FrameReader().feed(stray + GOOD) == [IT]


@pytest.mark.parametrize(
    ("damaged", "count"),
    [
        (GOOD[:4] + b"\x00" + GOOD[5:], "lengths"),
        (GOOD[:-1] + b"\x00", "checksums"),
        (GOOD[:9] + b"\xaa" + GOOD[10:], "checksums"),
        (b"\xff\xfe" + struct.pack("<H", LONGEST + 1) + bytes([255 - (0x10 + 1)]), "lengths"),
    ],
)
def test_a_damaged_frame_is_counted_and_loses_no_other(damaged, count):
    reader = FrameReader()
    assert reader.feed(damaged + GOOD) == [IT]
    assert getattr(reader.losses, count) == 1
    assert reader.losses.bytes == len(damaged)


def test_a_truncated_frame_loses_no_other():
    """A board resets in the middle of a long message, then sends again."""
    reader = FrameReader()
    begun = framed(125, bytes(200))[:60]
    assert reader.feed(begun + GOOD) == []
    assert reader.within_frame
    assert reader.give_up() == [IT]
    assert not reader.within_frame
    assert reader.losses.cut_short == 1


def test_a_frame_may_hold_what_looks_like_a_frame():
    outer = encode(130, GOOD + b"\xff\xfe")
    assert FrameReader().feed(outer + GOOD) == [Frame(130, GOOD + b"\xff\xfe"), IT]


def test_an_old_sketch_is_detected_by_its_frames():
    """ff ff, id, length, message, one checksum over all three: rosserial up to ROS groovy."""
    body = b"\x00\x00" + struct.pack("<H", len(LWHEEL)) + LWHEEL
    old = b"\xff\xff" + body + bytes([255 - sum(body) % 256])
    for reader in (FrameReader(), spoken_to := FrameReader()):
        spoken_to.feed(GOOD)
        assert [frame for byte in b"\x00\xff\xff" + old for frame in reader.feed(bytes([byte]))] == []
        assert reader.old_protocol is (reader is not spoken_to)


def test_old_frames_are_not_seen_in_noise():
    reader = FrameReader()
    reader.feed(b"\xff\xff\xff\xff\x00\x01\x02" * 50)
    assert not reader.old_protocol


frames_in_bytes = st.one_of(
    st.binary(max_size=40),
    st.just(b"\xff"),
    st.just(b"\xff\xfe"),
    st.builds(lambda cut: GOOD[:cut], st.integers(0, len(GOOD))),
    st.builds(lambda length: b"\xff\xfe" + struct.pack("<H", length), st.integers(0, 0xFFFF)),
)


@given(st.lists(frames_in_bytes, max_size=20), st.data())
def test_after_any_bytes_the_next_good_frame_is_found(chunks, data):
    reader = FrameReader()
    for chunk in chunks:
        reader.feed(chunk)
    found = reader.feed(GOOD)
    while reader.within_frame:
        found += reader.give_up()
    assert found[-1:] == [IT]
    assert FrameReader().feed(GOOD) == reader.feed(GOOD)


@given(st.lists(st.tuples(st.integers(0, 0xFFFF), st.binary(max_size=300)), max_size=5), st.integers(1, 50))
def test_frames_survive_any_split_of_the_stream(sent, step):
    stream = b"".join(encode(topic_id, message) for topic_id, message in sent)
    reader = FrameReader()
    got = [frame for at in range(0, len(stream), step) for frame in reader.feed(stream[at : at + step])]
    assert got == [Frame(topic_id, message) for topic_id, message in sent]
    assert stream == b"".join(framed(topic_id, message) for topic_id, message in sent)
    assert reader.losses.bytes == 0
