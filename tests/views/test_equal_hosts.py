"""Names and numbers in texts about hosts: what is one, and what only looks like one."""

from __future__ import annotations

import pytest

from swarmctl.views.equal_hosts import Names

OWN = Names("pi", "10.0.0.1", ("bot", "bot-1"), ("bot", "bot_1"))
OTHER = Names("pc", "10.0.0.2", ("ant", "ant-7"), ("ant", "ant_7"))


@pytest.mark.parametrize(
    ("own", "other"),
    [
        ("pi: bot-1 and bot", "pc: ant-7 and ant"),
        ("/bot_1/scan at 10.0.0.1:22", "/ant_7/scan at 10.0.0.2:22"),
        ("swarm-x.bot-1.service after 5 s", "swarm-x.ant-7.service after 12 s"),
        ("0.25 of 3 times, 0123456789abcdef", "1.5 of 7 times, fedcba9876543210"),
    ],
)
def test_names_and_measured_numbers_are_no_difference(own: str, other: str) -> None:
    assert OWN.pattern_of(own) == OTHER.pattern_of(other)
    assert OWN.values_in(own) != OTHER.values_in(other)


@pytest.mark.parametrize(
    "text", ["bots", "robot", "bot1", "xbot-1", "10.0.0.11", "pip", "v-5 s", "1.2.3", "00123456789abcdef"]
)
def test_what_only_contains_a_name_or_a_number_stays(text: str) -> None:
    assert OWN.pattern_of(text) == text
    assert OWN.values_in(text) == []


def test_of_two_names_at_one_place_the_longer_counts() -> None:
    assert OWN.values_in("bot-1 bot-12 bot") == ["bot-1", "bot", "bot"]
