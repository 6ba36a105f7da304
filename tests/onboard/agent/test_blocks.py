"""Our lines in /etc/hosts come and go; everybody else's bytes stay as they are."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.system_links import having, text_in, without

LINES = st.lists(
    st.sampled_from(
        [b"127.0.0.1 localhost", b"", b"\t# note", b"::1 ip6", b"# >>> swarm other", b"caf\xc3\xa9", b"\xff"]
    )
)
FILES = st.builds(
    lambda lines, end, last: end.join(lines) + (end if last else b""),
    LINES,
    st.sampled_from([b"\n", b"\r\n"]),
    st.booleans(),
) | st.binary(max_size=60)
TEXTS = st.lists(st.from_regex(rb"10\.0\.0\.[0-9] [a-z]{1,8}", fullmatch=True), max_size=4).map(
    lambda lines: b"".join(line + b"\n" for line in lines)
)


@given(FILES, TEXTS)
def test_adding_and_removing_leaves_every_byte(original: bytes, text: bytes) -> None:
    assert without(having(original, "new", text), "new") == original


@given(FILES, TEXTS, TEXTS)
def test_replacing_is_adding_the_other_text(original: bytes, first: bytes, second: bytes) -> None:
    assert having(having(original, "new", first), "new", second) == having(original, "new", second)


@given(FILES, TEXTS)
def test_the_text_can_be_read_back(original: bytes, text: bytes) -> None:
    assert text_in(having(original, "new", text), "new") == text
    assert text_in(original, "new") is None


@given(FILES, TEXTS, TEXTS, st.booleans())
def test_two_swarms_do_not_disturb_each_other(
    original: bytes, mine: bytes, other: bytes, mine_first: bool
) -> None:
    both = having(having(original, "new", mine), "newer", other)
    assert (text_in(both, "new"), text_in(both, "newer")) == (mine, other)
    order = ("new", "newer") if mine_first else ("newer", "new")
    assert without(without(both, order[0]), order[1]) == original


@given(FILES.filter(bool), TEXTS, st.sampled_from([b"10.9.9.9 late\n", b"10.9.9.9 late", b"\n# late\n"]))
def test_lines_that_came_after_the_block_stay_lines_of_their_own(
    original: bytes, text: bytes, late: bytes
) -> None:
    left = without(having(original, "new", text) + late, "new")
    assert left in (original + late, original + b"\n" + late)
    assert left.endswith(late)
    assert original.endswith(b"\n") or left[len(original) :].startswith(b"\n")


@given(FILES, TEXTS)
def test_a_block_survives_an_editor_that_ends_lines_with_crlf(original: bytes, text: bytes) -> None:
    edited = having(original, "new", text).replace(b"\r\n", b"\n").replace(b"\n", b"\r\n")
    assert text_in(edited, "new") == text.replace(b"\n", b"\r\n")
    assert text_in(without(edited, "new"), "new") is None


def test_a_name_that_begins_like_another_is_another() -> None:
    assert text_in(having(b"", "newer", b"1.1.1.1 a\n"), "new") is None


@pytest.mark.parametrize(
    "damaged",
    [b"# >>> swarm new\n1.1.1.1 a\n", b"1.1.1.1 a\n# <<< swarm new\n", b"# <<< swarm new\n# >>> swarm new\n"],
)
def test_a_block_with_a_lost_marker_is_not_guessed_at(damaged: bytes) -> None:
    for change in (lambda: having(damaged, "new", b""), lambda: without(damaged, "new")):
        with pytest.raises(RefusedError, match="lost one of its two marker lines"):
            change()


def test_a_text_with_a_marker_in_it_is_refused() -> None:
    with pytest.raises(RefusedError, match="contains a marker line"):
        having(b"", "new", b"# >>> swarm new\n# <<< swarm new\n")
