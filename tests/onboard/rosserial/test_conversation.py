"""The conversation with a board, on a clock that only moves when the test lets it."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.rosserial.conversation import (
    Lost,
    Negotiated,
    ParameterRequest,
    Phase,
    Received,
    UnsendableError,
)
from swarm_onboard.rosserial.messages import Log, twist
from swarm_onboard.rosserial.topics import MessageType

from tests.onboard.rosserial.fakes import (
    CMD_VEL,
    INT32,
    LWHEEL,
    REQUEST,
    RWHEEL,
    SETTLE,
    TIME_REQUEST,
    TOPICS,
    TWIST,
    TWIST_MD5,
    Table,
    announcement,
    framed,
    text,
)

TIME_REPLY = bytes.fromhex("ff fe 08 00 f7 0a 00 00 f1 53 65 00 65 cd 1d fd")
TX_STOP = bytes.fromhex("ff fe 00 00 ff 0b 00 f4")
OLD_REQUEST = bytes.fromhex("ff ff 00 00 00 00 ff 00")
TICKS = framed(125, struct.pack("<i", 1234))
COMMAND = framed(100, twist(0.2, -0.5))
GREETING = framed(7, b"\x01" + text("swarmctl firmware 0123456789ab"))


def negotiated(table: Table) -> list[Negotiated]:
    return [event for event in table.events if isinstance(event, Negotiated)]


def test_nothing_is_sent_to_a_board_that_still_starts():
    table = Table()
    assert table.receive(b"bootloader \xff\xfe", *TOPICS, TICKS) == []
    table.run(SETTLE - 0.01)
    assert (table.sent(), table.host.phase) == ([], Phase.SETTLING)
    table.run(0.01)
    assert table.sent() == [REQUEST]


def test_topics_are_negotiated():
    table = Table().settled()
    table.sent()
    table.receive(TIME_REQUEST)
    assert table.sent() == [TIME_REPLY]
    table.receive(*TOPICS)
    assert table.host.phase is Phase.ASKING  # more may follow
    [event] = table.run(0.5)
    assert isinstance(event, Negotiated)
    assert [(one.id, one.name, one.type, one.capacity, one.published) for one in event.topics] == [
        (125, "lwheel", INT32, 272, True),
        (126, "rwheel", INT32, 272, True),
        (100, "cmd_vel", TWIST, 280, False),
    ]
    assert event.refusals == ()
    assert table.host.phase is Phase.CONNECTED


def test_what_follows_the_announcements_ends_them_and_is_not_lost():
    table = Table().settled()
    first, second = table.receive(TIME_REQUEST, *TOPICS, TICKS)
    assert isinstance(first, Negotiated)
    assert isinstance(second, Received)
    assert (second.topic.name, second.message) == ("lwheel", struct.pack("<i", 1234))


def test_a_silent_board_is_requested_again_and_reported():
    table = Table().settled()
    table.run(15.0)
    assert table.sent()[:3] == [REQUEST, OLD_REQUEST, REQUEST]
    [lost] = table.events
    assert lost == Lost("the board has sent nothing for 15 s")


def test_a_wrong_baud_rate_differs_from_no_bytes():
    table = Table().settled()
    for _ in range(16):
        table.receive(b"\x00\x80\xf8\xff")
        table.run(1.0)
    assert [event for event in table.events if isinstance(event, Lost)] == [
        Lost("the bytes from the board are not rosserial: check the baud rate and the sketch")
    ]


def test_a_sketch_of_an_old_rosserial_is_named():
    table = Table().settled()
    body = b"\x00\x00" + struct.pack("<H", 4) + b"\x01\x02\x03\x04"
    table.receive(b"\xff\xff" + body + bytes([255 - sum(body) % 256]))
    table.run(15.0)
    [lost] = table.events
    assert "rosserial 0.4 (of ROS groovy or older)" in lost.reason


def test_every_request_for_the_time_is_answered():
    table = Table().connected()
    for _ in range(40):
        table.run(2.5)
        assert table.sent() == []
        table.receive(TIME_REQUEST)
        assert table.sent() == [TIME_REPLY]
    assert table.events == []


def test_without_time_requests_a_board_is_lost_after_15_s():
    table = Table().connected()
    table.receive(TIME_REQUEST)
    start = table.now
    table.sent()
    table.run(20.0)
    sent = [(round(at - start, 3), data) for at, data in table.written]
    assert sent[:2] == [(6.0, REQUEST), (12.0, REQUEST)]
    assert [type(event) for event in table.events] == [Lost]
    assert table.events[0].reason == "no sync with the board: it has not requested the time for 15 s"
    assert table.host.phase is Phase.ASKING
    assert [at for at, data in sent if data == REQUEST][-3:] == [15.0, 17.0, 19.0]


def test_a_lost_board_that_comes_back_is_negotiated_anew():
    table = Table().connected()
    table.run(16.0)
    table.receive(TIME_REQUEST, *TOPICS, TICKS)
    assert [type(event) for event in table.events] == [Lost, Negotiated, Received]


def test_a_silent_reset_of_the_board_is_detected():
    """A restarted board sends nothing until its topics are requested."""
    table = Table().connected()
    table.run(5.7)
    assert table.sent() == []
    table.run(0.2)
    assert table.sent() == [REQUEST]
    assert [type(one) for one in table.receive(TIME_REQUEST, *TOPICS, TICKS)] == [Received]
    table.run(4.0)
    assert table.host.phase is Phase.CONNECTED


def test_a_board_that_reports_its_start_negotiates_at_once():
    table = Table().connected()
    table.receive(TIME_REQUEST)
    table.run(1.0)
    table.sent()
    assert table.receive(GREETING) == [Log(1, "swarmctl firmware 0123456789ab")]
    assert table.sent() == [REQUEST]
    assert [type(one) for one in table.receive(TIME_REQUEST, *TOPICS, GREETING, TICKS)] == [Log, Received]
    assert table.sent() == [TIME_REPLY]


def test_a_version_after_lost_announcements_is_no_start():
    table = Table().settled()
    table.sent()
    for _ in range(3):
        table.receive(GREETING)
    assert table.sent() == []
    table.receive(TIME_REQUEST, *TOPICS, GREETING)
    assert table.sent() == [TIME_REPLY]


def test_a_board_with_another_sketch_replaces_all_it_announced():
    table = Table().connected()
    table.run(6.0)
    table.receive(TIME_REQUEST, announcement(0, 104, "odo"), CMD_VEL)
    table.run(0.5)
    [event] = table.events
    assert [one.name for one in event.topics] == ["odo", "cmd_vel"]
    assert table.receive(TICKS) == []
    assert table.host.strange == 1


def test_a_lost_announcement_is_requested():
    table = Table().settled()
    table.sent()
    table.receive(TIME_REQUEST, LWHEEL, RWHEEL[:-1] + b"\x00", CMD_VEL)
    table.run(0.5)
    assert table.sent() == [TIME_REPLY, REQUEST]
    table.receive(TIME_REQUEST, *TOPICS)
    table.run(0.5)
    assert [len(one.topics) for one in negotiated(table)] == [2, 3]


def test_requests_end_on_a_line_that_damages_every_round():
    table = Table().settled()
    for _ in range(10):
        table.receive(TIME_REQUEST, LWHEEL, RWHEEL[:-1] + b"\x00", CMD_VEL)
        table.run(0.5)
    assert table.sent().count(REQUEST) <= 8
    assert [one.name for one in table.host.topics] == ["lwheel", "cmd_vel"]


def test_a_message_of_an_unknown_topic_makes_the_host_ask():
    table = Table().connected()
    table.receive(TIME_REQUEST)
    table.run(2.0)
    table.sent()
    table.receive(framed(127, b"\0"), framed(127, b"\0"))
    assert table.sent() == [REQUEST]
    assert table.host.strange == 2


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (announcement(0, 127, "scan", "my_msgs/Scan"), "my_msgs/Scan, which no package on this host has"),
        (announcement(1, 101, "go", INT32, md5="0" * 32), "another definition"),
        (
            announcement(1, 101, "go", TWIST, md5=TWIST_MD5, size=40),
            "48 bytes at least, but its buffer holds 40",
        ),
        (
            announcement(0, 127, "way", TWIST, md5=TWIST_MD5, size=55),
            "48 bytes at least, but its buffer holds 47",
        ),
        (announcement(1, 101, "go", TWIST, md5=TWIST_MD5, size=-1), "buffer holds 0"),
        (announcement(0, 7, "log"), "which the protocol reserves"),
        (announcement(2, 127, "reset", "std_srvs/Empty"), "a service"),
    ],
)
def test_a_topic_that_cannot_be_served_is_refused_with_a_reason(data, reason):
    table = Table().settled()
    table.receive(TIME_REQUEST, *TOPICS, data)
    table.run(0.5)
    [event] = table.events
    assert [one.name for one in event.topics] == ["lwheel", "rwheel", "cmd_vel"]
    [refusal] = event.refusals
    assert reason in refusal.reason
    assert f"`{refusal.name}`" in refusal.reason


@pytest.mark.parametrize("table", [Table(), Table().settled()], ids=["settling", "asking"])
def test_nothing_is_sent_before_the_board_is_connected(table):
    table.sent()
    with pytest.raises(UnsendableError):
        table.host.send("cmd_vel", twist(0.2, 0.0))
    assert table.sent() == []


def test_commands_reach_the_board():
    table = Table().connected()
    table.host.send("cmd_vel", twist(0.2, -0.5))
    assert table.sent() == [COMMAND]


@pytest.mark.parametrize("name", ["lwheel", "other"])
def test_nothing_is_sent_on_topics_without_subscription(name):
    table = Table().connected()
    with pytest.raises(UnsendableError, match="does not subscribe to"):
        table.host.send(name, bytes(4))
    assert table.sent() == []


@pytest.mark.parametrize(("length", "passes"), [(64, True), (65, False)])
def test_no_message_is_larger_than_the_boards_buffer(length, passes):
    kind = {"std_msgs/String": MessageType("992ce8a1687cec8c8bd883ec73ca41d1", 4)}
    data = announcement(1, 101, "say", "std_msgs/String", md5="992ce8a1687cec8c8bd883ec73ca41d1", size=64)
    table = Table(kind).connected([data])
    if passes:
        table.host.send("say", bytes(length))
        assert table.sent() == [framed(101, bytes(length))]
    else:
        with pytest.raises(UnsendableError, match="has 65 bytes; the board's buffer holds 64"):
            table.host.send("say", bytes(length))
        assert table.sent() == []


def test_logs_and_parameter_requests_are_events():
    table = Table().connected()
    assert table.receive(framed(7, b"\x02" + text("low battery")), framed(6, text("~kp"))) == [
        Log(2, "low battery"),
        ParameterRequest("~kp"),
    ]
    table.host.parameter("~kp", 7)
    assert table.sent() == [bytes.fromhex("fffe1000ef060001000000070000000000000000000000f1")]


@pytest.mark.parametrize(
    ("value", "reason"),
    [({"a": 1}, "~kp: rosserial has only"), ("x" * 269, "has 285 bytes; the board's buffer holds 280")],
)
def test_a_parameter_that_a_board_cannot_take_is_not_sent(value, reason):
    table = Table().connected()
    with pytest.raises(UnsendableError, match=reason):
        table.host.parameter("~kp", value)
    assert table.sent() == []


def test_a_truncated_message_does_not_delay_the_next():
    table = Table().connected()
    table.receive(framed(125, bytes(250))[:50])
    table.receive(TICKS)
    assert [type(event) for event in table.run(0.6)] == [Received]
    assert table.host.reader.losses.cut_short == 1


def test_stop_is_sent_to_the_board():
    table = Table().connected()
    table.host.stop()
    assert table.sent() == [TX_STOP]


WORDS = (
    *TOPICS,
    TICKS,
    TIME_REQUEST,
    framed(7, b"\x01" + text("hi")),
    GREETING,
    framed(6, text("~a")),
    framed(0, b"short"),
    framed(10, b""),
    framed(125, b""),
    framed(5, b""),
    framed(65535, b"x"),
    b"\xff",
    b"\xff\xfe\x00",
    b"",
)


@given(
    st.lists(
        st.tuples(st.one_of(st.sampled_from(WORDS), st.binary(max_size=60)), st.floats(0, 20)), max_size=25
    )
)
def test_any_input_is_followed_by_a_working_connection(received):
    table = Table()
    for data, pause in received:
        table.receive(data)
        table.run(pause)
    table.run(SETTLE + 16.0)
    table.sent()
    table.receive(TIME_REQUEST, *TOPICS)
    table.run(1.0)
    table.receive(TIME_REQUEST, *TOPICS)  # a frame that was begun may have eaten a part of the first
    table.run(1.0)
    table.sent()
    table.host.send("cmd_vel", twist(0.2, -0.5))
    assert table.sent() == [COMMAND]
    [event] = table.receive(TICKS)
    assert isinstance(event, Received)
