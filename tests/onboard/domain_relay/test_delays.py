"""What the relay remembers of late commands."""

from __future__ import annotations

from swarm_onboard.domain_relay.delays import Delays


def test_only_what_is_late_is_named_and_for_a_minute() -> None:
    found = Delays()
    found.add(0.0, 0.02, dropped=False)
    assert (found.text(1.0), found.dropped(1.0)) == ("", 0)
    found.add(2.0, 0.3, dropped=False)
    assert found.text(3.0) == "up to 0.3 s late"
    found.add(4.0, 1.25, dropped=True)
    found.add(4.1, 0.9, dropped=True)
    assert (found.text(5.0), found.dropped(5.0)) == ("up to 1.2 s late, 2 dropped", 2)
    assert found.text(63.0) == "up to 1.2 s late, 2 dropped", "the first is not remembered"
    assert (found.text(64.05), found.dropped(64.05)) == ("up to 0.9 s late, 1 dropped", 1)
    assert (found.text(70.0), found.dropped(70.0)) == ("", 0)


def test_a_flood_is_remembered_in_part() -> None:
    found = Delays()
    for number in range(5000):
        found.add(number * 1e-3, 2.0, dropped=True)
    assert found.dropped(5.0) == 2000
