"""Which commands were held up by a network, whatever the clocks of the hosts are."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.ros2.late import Late

LIMIT = 0.5
SENDER, OTHER = b"a" * 16, b"b" * 16


def late(moments: list[tuple[float, float]], skew: float = 0.0) -> list[bool]:
    """Whether each of some commands is late; pairs of departure and delay, s."""
    found = Late(LIMIT)
    return [found.is_late(SENDER, sent, sent + delay + skew) for sent, delay in moments]


@given(st.floats(-1e6, 1e6))
def test_a_command_that_an_outage_held_up_is_late_whatever_the_clocks(skew: float) -> None:
    assert late([(0.0, 0.01), (0.1, 0.02), (0.2, 8.0), (8.3, 0.01)], skew) == [False, False, True, False]


@given(st.lists(st.floats(0.0, 0.4), min_size=1))
def test_a_network_that_delays_by_less_than_the_limit_loses_nothing(delays: list[float]) -> None:
    assert not any(late([(index * 0.1, delay) for index, delay in enumerate(delays)]))


def test_after_a_clock_was_set_commands_count_again_before_long() -> None:
    before = [(index * 0.1, 0.01) for index in range(10)]
    after = [(1.0 + index * 0.1, 30.0) for index in range(30)]
    found = late(before + after)
    assert found[10]
    assert not any(found[25:])


def test_each_sender_has_its_own_clock() -> None:
    found = Late(LIMIT)
    assert not found.is_late(SENDER, 0.0, 0.01)
    assert not found.is_late(OTHER, 0.0, 99.0)
    assert not found.is_late(SENDER, 1.0, 1.01)
