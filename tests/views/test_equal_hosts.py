"""Names and numbers in texts about hosts: what is one, and what only looks like one."""

from __future__ import annotations

import pytest

from swarmctl.views.equal_hosts import Names, merged, merged_behind

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


MANY = [Names(name, f"10.0.0.{number}") for number, name in enumerate(("desk", "rover", "tb-1", "tb-2"), 1)]


@pytest.mark.parametrize(
    ("text", "together"),
    [
        ("log in to {0.host}", "log in to desk, and 3 more"),
        ("{0.host} runs {1:016}", "desk runs 0000000000000001, and 3 more"),
        ("runs {1:016} since {1}.5 s", "runs 0000000000000001 since 1.5 s, and 3 more"),
        ("{0.address} is off", "10.0.0.[1-4] is off"),
        ("since {1}.5 s", "since 1.5-4.5 s"),
        ("is off", "is off"),
    ],
)
def test_values_that_are_no_range_are_the_first_and_a_count(text: str, together: str) -> None:
    texts = [text.format(own, number) for number, own in enumerate(MANY, 1)]
    assert merged(texts, MANY) == together


@pytest.mark.parametrize(
    ("text", "several", "alone"),
    [
        (
            "{0.host} ({0.address}, port 22) is off",
            "each (port 22) is off",
            "desk (10.0.0.1, port 22) is off",
        ),
        ("{0.host} ({0.address}) is off", "each is off", "desk (10.0.0.1) is off"),
        ("{0.host} is off", "each is off", "desk is off"),
        ("{0.host}: no space", "no space", "no space"),
        ("log in to {0.host}", "log in to desk, and 3 more", "log in to desk"),
    ],
)
def test_behind_its_names_a_text_repeats_none(text: str, several: str, alone: str) -> None:
    texts = [text.format(own) for own in MANY]
    assert merged_behind(texts[:1], MANY[:1]) == alone
    assert merged_behind(texts, MANY) == several
