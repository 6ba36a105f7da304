"""Each bar of the benchmark of relays can be missed."""

from __future__ import annotations

from collections.abc import Sequence

from endurance.looks import Look, Stretch, Weight
from relay_endurance import Endured, bars_of_relay, bars_of_robots

from tests.e2e.experiment import STILL

EVERY, LONG = 0.1, 10.0  # s
SPEED = 0.2  # m/s


def stretch(*, held: bool, moving: Sequence[tuple[float, float]] = (), lost: float = 0.0) -> Stretch:
    """What is seen of a robot that moves in these spans, while the swarm waits ``lost`` s for a CPU."""
    found = Stretch(held, began=100.0, lost=lost)
    for number in range(round(LONG / EVERY)):
        now = number * EVERY
        way = SPEED * sum(max(0.0, min(now, end) - begin) for begin, end in moving)
        names = frozenset({"tb3"} if any(begin <= now < end for begin, end in moving) else ())
        found.looks.append(Look(found.began + now, names, {"tb3": way}))
    return found


HELD = stretch(held=True, moving=[(0.2, LONG)])


def missed(*stretches: Stretch) -> list[str]:
    return [bar for bar, kept in bars_of_robots(Endured(stretches, {}, 0.0, ()), ["tb3"]) if not kept]


def test_a_robot_that_follows_and_stops_misses_nothing() -> None:
    seen = Endured([HELD, stretch(held=False, moving=[(0.0, STILL - EVERY)])], {}, 0.0, ())
    bars = list(bars_of_robots(seen, ["tb3"]))
    assert all(kept for _, kept in bars)
    assert bars[0][0].endswith("never")


def test_a_robot_that_drives_on_misses_its_bar() -> None:
    (bar,) = missed(HELD, stretch(held=False, moving=[(0.0, STILL + 1.0)]))
    assert "moves later than" in bar


def test_a_robot_that_starts_in_silence_misses_its_bar() -> None:
    (bar,) = missed(HELD, stretch(held=False, moving=[(5.0, 5.5)]))
    assert "moves later than" in bar


def test_a_machine_that_withholds_the_cpu_is_no_fault_of_a_relay() -> None:
    late = [(0.0, STILL + 1.0)]
    assert missed(HELD, stretch(held=False, moving=late, lost=1.1)) == []
    assert len(missed(HELD, stretch(held=False, moving=late, lost=0.5))) == 1


def test_motion_between_two_looks_misses_its_bar() -> None:
    (bar,) = missed(HELD, stretch(held=False, moving=[(5.01, 5.09)]))
    assert "between two looks" in bar


def test_a_robot_that_is_hardly_driven_misses_its_bar() -> None:
    (bar,) = missed(stretch(held=True, moving=[(0.2, 7.0)]), stretch(held=False))
    assert "of the time the button is held" in bar


def test_a_relay_that_grows_misses_its_bars() -> None:
    assert all(kept for _, kept in bars_of_relay("hub", [Weight(70.0, 26, 16)] * 30))
    growing = [Weight(70.0 + number, 26 + number, 16 + number) for number in range(30)]
    assert [kept for _, kept in bars_of_relay("hub", growing)] == [False] * 3
