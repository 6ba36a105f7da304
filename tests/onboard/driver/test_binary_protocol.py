"""Bytes without frames: nothing that arrives is taken for what it is not, and nothing hurts."""

from __future__ import annotations

import contextlib
import math
import struct
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.driver.binary_protocol import BinaryReader
from swarm_onboard.driver.codec import BadReplyError, Reply
from swarm_onboard.driver.link import FAILED_EXCHANGE, NoReplyError
from swarm_onboard.driver.polled_robot import linked
from swarm_onboard.driver.protocols import BinaryProtocol, BinaryQuery
from swarm_onboard.driver.tally import Tally

from tests.onboard.driver.fakes import TYPES, Bench, Clock, config_for

SENSES = struct.pack("<3h8h8h2h3h", *range(24))


class Script:
    """A port that gives the prepared answer to each request, piece by piece; ``late`` comes unrequested."""

    def __init__(self, clock: Clock, *answers: list[bytes]) -> None:
        self.clock = clock
        self.answers = list(answers)
        self.pieces: list[bytes] = []
        self.late: list[bytes] = []
        self.written: list[bytes] = []

    def write(self, data: bytes) -> None:
        self.written.append(data)
        self.pieces = [*self.late, *self.answers.pop(0)]
        self.late = []

    def read(self, timeout: float) -> bytes:
        if self.pieces:
            return self.pieces.pop(0)
        self.clock.now += timeout
        return b""

    def drain(self) -> None:
        """What is on its way is not there yet."""

    def close(self) -> None:
        """Nothing to let go of."""


def wired(*answers: list[bytes], type_name: str = "epuck-binary"):
    clock = Clock()
    port = Script(clock, *answers)
    return port, linked(port, config_for(type_name).protocol, Tally(), clock)


def test_a_reply_in_pieces_is_whole_at_its_last_byte():
    _, link = wired([SENSES[:1], SENSES[1:40], SENSES[40:]])
    assert link.ask(link.codec.query("senses")).values == tuple(range(24))


def test_a_reply_one_byte_short_is_none():
    _, link = wired([SENSES[:-1]])
    with pytest.raises(NoReplyError):
        link.ask(link.codec.query("senses"))


def test_a_reply_one_byte_too_long_is_none():
    _, link = wired([SENSES + b"\0"])
    with pytest.raises(BadReplyError, match="49 bytes or more instead of 48"):
        link.ask(link.codec.query("senses"))


def test_an_echo_of_another_speed_is_no_confirmation():
    _, link = wired([struct.pack("<2h", 500, 500)])
    with pytest.raises(BadReplyError, match="instead of"):
        link.set_speed(500, -500)


def test_the_end_of_a_late_reply_is_not_the_beginning_of_the_next():
    """The robot answers too late: the rest comes after the driver has given up, and is let pass."""
    port, link = wired([SENSES[:40]], [SENSES])
    with pytest.raises(NoReplyError):
        link.ask(link.codec.query("senses"))
    port.pieces = [SENSES[40:]]  # 8 bytes, which with 40 of the next reply would make one of wrong numbers
    assert link.ask(link.codec.query("senses")).values == tuple(range(24))


def test_a_stop_waits_for_no_late_bytes_and_must_be_repeated():
    port, link = wired([SENSES[:40]], [SENSES[40:44], struct.pack("<2h", 0, 0)], [struct.pack("<2h", 0, 0)])
    with pytest.raises(NoReplyError):
        link.ask(link.codec.query("senses"))
    sent_at = link._clock()
    with pytest.raises(BadReplyError):
        link.set_speed(0, 0)
    assert link._clock() == sent_at, "it was reported at once"
    link.set_speed(0, 0)
    assert port.written[-1] == port.written[-2] == bytes.fromhex("bc 00 00 00 00 bb 00")


def test_a_babbling_robot_does_not_hold_up_its_driver():
    clock = Clock()

    class Babbler(Script):
        def read(self, timeout: float) -> bytes:
            self.clock.now += 0.001
            return b"\x55"

    link = linked(Babbler(clock, *[[]] * 9), config_for("epuck-binary").protocol, Tally(), clock)
    with pytest.raises(BadReplyError):
        link.set_speed(0, 0)
    before = clock.now
    with contextlib.suppress(*FAILED_EXCHANGE):
        link.ask(link.codec.query("battery"), 0.1)
    assert clock.now - before <= 0.1 + 0.002


@given(layout=st.sampled_from(["<2h", "<3h8h8h2h3h", "<H", "<3f"]), pieces=st.lists(st.binary(max_size=300)))
def test_no_stream_of_bytes_upsets_the_reader_or_fills_the_memory(layout, pieces):
    reader = BinaryReader(struct.Struct(layout), ())
    for piece in pieces:
        try:
            reply = reader.feed(piece)
        except BadReplyError:
            return
        assert len(reader._arrived) <= struct.calcsize(layout)
        if reply is not None:
            assert isinstance(reply, Reply)
            return


@pytest.mark.parametrize("type_name", TYPES)
@given(noise=st.lists(st.binary(max_size=200), max_size=10))
def test_an_exchange_ends_in_time_whatever_a_robot_sends(type_name, noise):
    clock = Clock()
    protocol = config_for(type_name).protocol
    link = linked(Script(clock, *[list(noise) for _ in range(40)]), protocol, Tally(), clock)
    requests = [link.codec.speed(1, -1), *(link.codec.query(name) for name in protocol.queries)]
    for request in requests[:10]:
        before = clock.now
        with contextlib.suppress(*FAILED_EXCHANGE):
            link.ask(request)
        assert clock.now - before <= 2 * protocol.reply_timeout + 1e-6


class Overtaken:
    """Repeats speeds and reports still wheels, ``takes`` s after each request and in their order."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.takes = 0.01
        self.coming: list[tuple[float, bytes]] = []
        self.last = 0.0

    def open(self) -> Overtaken:
        return self

    def write(self, data: bytes) -> None:
        self.last = max(self.last, self.clock.now) + self.takes
        self.coming.append((self.last, data[1:] if data[0] == 0xBC else struct.pack("<hh", 1000, 1000)))

    def read(self, timeout: float) -> bytes:
        end = self.clock.now + timeout
        arrives = self.coming[0][0] if self.coming else math.inf
        self.clock.now = max(self.clock.now, min(arrives, end))
        return self.coming.pop(0)[1] if arrives <= end else b""

    def drain(self) -> None:
        self.coming = [one for one in self.coming if one[0] > self.clock.now]

    def close(self) -> None:
        """Nothing to let go of."""


@pytest.mark.parametrize("takes", [0.11, 0.13, 0.18])
def test_the_answer_to_a_repeated_speed_is_no_position(takes):
    """A stop waits for no late answer, and may take it for its own: then its own is still to come."""
    set_speed = BinaryQuery("bc {left:h} {right:h}", "2h")
    protocol = BinaryProtocol(0.1, "little", None, (), set_speed, {"position": BinaryQuery("af", "2h")})
    koala = config_for("koala")
    config = replace(koala, protocol=protocol, actuators=(), sensors=(koala.sensor("odom"),))
    bench = Bench(config, Overtaken)
    bench.run(1.0)
    for number in range(100):
        bench.robot.takes = takes if number % 20 == 10 else 0.01
        bench.command(0.01 * (number % 5))
        bench.run(0.1)
    assert int(bench.sink.reports[-1].values["failed exchanges"]) > 2
    assert bench.sink.poses[-1].driven == 0.0
