"""The grammar of selections: what binds how, and errors with their column."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.yamltext.selection_text import SelectionError, is_selection, parse, words_in

TEXTS = st.text(alphabet="ab1-*?@!&,():[] =é", max_size=30)


@given(TEXTS)
def test_a_text_is_read_or_has_an_error_within_it(text: str) -> None:
    error = None
    try:
        parse(text)
    except SelectionError as raised:
        error = raised
    assert error is None or (0 <= error.start < error.end <= len(text) + 1 and error.help_lines)


@given(st.lists(st.sampled_from(["a", "b-*", "c-[1-3]", "@d", "type:e"]), min_size=1, max_size=5))
def test_blanks_around_operators_change_nothing(words: list[str]) -> None:
    tight, wide = parse(",".join(words)), parse(" , ".join(words))
    assert [one.text for one in words_in(",".join(words))] == words
    assert len(tight.parts) == len(wide.parts) == len(words)


@pytest.mark.parametrize(
    ("text", "column", "message", "help_"),
    [
        ("", 0, "a name is missing at the end", "write a name"),
        ("a,,b", 2, "a name is missing before `,`", "remove what joins it"),
        ("a b", 2, "a comma is missing here", "`a,b` for both"),
        ("a,(b&c", 2, "this parenthesis is not closed", "`a,(b&c)`"),
        ("a)", 1, "nothing opens this parenthesis", "remove it"),
        ("x,!a&b", 2, "this can be read in two ways", "`b&!a`, or `!(a&b)`"),
        ("!!a", 1, "there are two `!`", "one of them"),
        ("a,group:x", 2, "there is no prefix `group:`", "`@x`"),
        ("tpye:x", 0, "there is no prefix `tpye:`", "did you mean `type:`?"),
        ("type=epuck2", 0, "`type=epuck2` is not a name", "`type:epuck2`"),
        ("host:", 0, "a name is missing after `host:`", "`host:lab`"),
        ("ep-[5-1]", 0, "the range 5-1 runs backwards", "`ep-[1-5]`"),
        ("((((((((((a))))))))))", 8, "parentheses are nested too deep here", "a group"),
        ("a-[0-9999],b,c-[0-9999]," * 9, 109, "this has more than 100000 names", "globs"),
    ],
)
def test_errors(text: str, column: int, message: str, help_: str) -> None:
    with pytest.raises(SelectionError) as caught:
        parse(text)
    assert caught.value.message == message
    assert help_ in caught.value.help_lines[0]
    assert caught.value.start == column


@pytest.mark.parametrize(("text", "more"), [("k3", False), ("k3-[1,3]", False), ("@k3", True), ("a,b", True)])
def test_names_and_ranges_alone_are_no_selections(text: str, more: bool) -> None:
    assert is_selection(text) is more
