"""The Koala 2.5, byte for byte, where it differs from the classic one."""

from __future__ import annotations

import math

import pytest

from swarmctl.lab.emulators import Wall, emulator
from swarmctl.lab.emulators.koala25 import Koala25


@pytest.mark.parametrize(
    ("request_", "reply"),
    [
        (b"A,0\r", b"a\r"),
        (b"B\r", b"b,A-02\r"),  # seven bytes, as the maker's library reads them
        (b"C,28,204\r", b"c\r"),
        (b"D,50,-50\r", b"d\r"),
        (b"E\r", b"e,0,0\r"),
        (b"F,100,100\r", b"f\r"),
        (b"G\r", b"g,1000,1000,1000,1000,1000,1000,1000,1000,1000\r"),
        (b"H,10,3,1\r", b"h\r"),
        (b"I,0,0\r", b"i\r"),
        (b"J,5,1,10,200,10,10\r", b"j\r"),
        (b"K,50,-50\r", b"k\r"),
        (b"L,2000,-2000\r", b"l\r"),
        (b"O\r", b"o,1,1\r"),
        (b"P\r", b"p,0,0\r"),
        (b"Q\r", b"q,V,00,0000.0000,N,00000.0000,E,00:00:00,00.00.00,0.0,0\r"),
        (b"R,30,0,3\r", b"r,255,255,255\r"),
        (b"S,5,0,1,0,1\r", b"s\r"),
        (b"T\r", b"t,0,0\r"),
        (b"U\r", b"u,515,513\r"),
        (b"V\r", b"v,1,260,7,0\r"),
        (b"W,30,0,1,2\r", b"w\r"),
        (b"X,$PMTK000\r", b"x\r"),
        (b"Y\r", b"y,0,0,0,0\r"),
        (b"Z\r", b"z\r"),
        (b"&\r", b"@,220,0,-420\r"),
        (b"?\r", b"!,0\r"),
        (b"\r\n\nE\r\n", b"e,0,0\r"),
        (b"D,50\r", b"#\r"),
        (b"N,1\r", b"#\r"),
        (b"W,30,x,1\r", b"#\r"),
    ],
)
def test_every_request_has_its_reply(request_: bytes, reply: bytes) -> None:
    assert emulator("koala-2.5").receive(request_) == reply


def test_a_reply_may_end_with_lf_instead() -> None:
    koala = emulator("koala-2.5", terminator="lf")
    assert koala.receive(b"B\rx\r") == b"b,A-02\n#\n"


def test_a_speed_unit_is_1_1076_mm_per_second() -> None:
    koala = emulator("koala-2.5")
    assert koala.receive(b"D,100,-100\rE\r") == b"d\re,100,-100\r"
    assert koala.state.left == pytest.approx(0.11076, rel=1e-4)
    koala.advance(1.0)
    assert koala.receive(b"P\r") == b"p,10000,-10000\r"


def test_motors_report_their_mode() -> None:
    koala = emulator("koala-2.5")
    assert koala.receive(b"K,9,9\rY\r") == b"k\ry,2,2,0,0\r"
    assert koala.receive(b"L,9,9\rY\r") == b"l\ry,4,4,0,0\r"
    assert koala.receive(b"I,0,0\rF,2000,1000\rY\r") == b"i\rf\ry,3,3,0,0\r"
    koala.advance(0.06)  # 200 pulses in 10 ms
    assert koala.receive(b"Y\r") == b"y,3,3,0,1\r"
    koala.advance(1.0)
    assert koala.receive(b"Y\rP\r") == b"y,3,3,1,1\rp,2000,1000\r"


def test_setting_counters_stops_a_move_to_a_position() -> None:
    koala = emulator("koala-2.5")
    koala.receive(b"F,9000,9000\rI,0,0\r")
    assert koala.state.v == 0.0


def test_ultrasound_reports_too_near_too_far_and_off() -> None:
    koala = emulator("koala-2.5", walls=[Wall(0.175 + 1.0, -5.0, 0.175 + 1.0, 5.0)])

    def ahead() -> int:
        return int(koala.receive(b"G\r").split(b",")[4])

    assert ahead() == 100
    koala.receive(b"C,503,0\r")  # all but the one in front
    assert ahead() == 2000
    koala.receive(b"C,511,0\r")
    koala.chassis.place(0.9, 0.0, 0.0)
    assert ahead() == 0
    koala.chassis.place(-2.0, 0.0, 0.0)
    assert ahead() == 1000


def test_the_gyroscope_and_the_compass_turn_with_it() -> None:
    koala = emulator("koala-2.5")
    koala.receive(b"D,-50,50\r")
    values = [int(value) for value in koala.receive(b"N\r")[2:].split(b",")]
    assert len(values) == 30
    assert values[2] * 0.066 == pytest.approx(math.degrees(koala.state.omega), abs=0.5)
    koala.chassis.place(0.0, 0.0, math.pi / 2)
    assert koala.receive(b"&\r") == b"@,0,-220,-420\r"
    gravity = [int(value) for value in koala.receive(b"M\r")[2:].split(b",")]
    assert gravity[2] == pytest.approx(16384, abs=10)


def test_enabled_reports_are_sent_unsolicited() -> None:
    koala = emulator("koala-2.5")
    assert koala.run_for(10.0) == []
    koala.receive(b"D,10,10\rA,6\r")
    assert koala.run_for(0.25) == [b"e,10,10\r", b"p,100,100\r", b"e,10,10\r", b"p,200,200\r"]
    koala.receive(b"A,0\r")
    assert koala.run_for(10.0) == []


def test_power_outputs_are_in_the_state_and_go_off_with_it() -> None:
    koala = emulator("koala-2.5")
    koala.receive(b"S,9,1,0,1,0\r")
    assert koala.state.lights == {"power0": 1, "power1": 0, "power2": 0, "power3": 1}
    assert koala.receive(b"T\r") == b"t,5,0\r"
    koala.power_cycle()
    assert not any(koala.state.lights.values())


def test_it_is_a_type_of_its_own() -> None:
    with pytest.raises(ValueError, match="'terminator' is cr or lf"):
        Koala25(terminator="crlf")
