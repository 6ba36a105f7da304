"""Did you mean: the likely word, found as fast among ten thousand as among ten."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.suggest import did_you_mean, nearest
from tests.timing import work_at_most

ROBOTS = tuple(f"bot-{number:05}" for number in range(10_000))


@pytest.mark.parametrize("wrong", ["bott-01234", "bo-01234", "bat-01234", "bot-012x34"])
def test_of_ten_thousand_names_the_nearest_is_suggested(wrong: str) -> None:
    assert nearest(wrong, ROBOTS) == "bot-01234"


@given(st.integers(0, 9_999), st.integers(0, 8), st.sampled_from("abcxyz"))
def test_a_letter_too_many_is_found_anywhere(number: int, place: int, letter: str) -> None:
    name = ROBOTS[number]
    assert nearest(name[:place] + letter + name[place:], ROBOTS) == name


def test_nothing_is_guessed_of_a_name_unlike_all_of_them() -> None:
    assert did_you_mean("kitchen-door", ROBOTS, "robots") == ()


def test_a_name_is_not_suggested_for_itself() -> None:
    assert nearest("bot-01234", ROBOTS) is None


def test_a_thousand_wrong_names_in_a_large_spec_take_little_work() -> None:
    with work_at_most(100):  # comparing each with all took minutes
        assert all(did_you_mean(f"bott-{number:05}", tuple(ROBOTS), "robots") for number in range(1_000))


def test_a_word_that_goes_on_is_likelier_than_one_with_several_other_letters() -> None:
    assert nearest("deadman", ("dead_zone", "deadman_button")) == "deadman_button"
    assert nearest("dead_zne", ("dead_zone", "dead_zne_button")) == "dead_zone"
