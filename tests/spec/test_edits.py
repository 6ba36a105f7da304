"""A change of a spec's text changes what it says, and nothing else that stands there."""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.spec.diagnostics import Edit, Span
from swarmctl.spec.edits import Edits, append_item, apply, mend, remove, rename_key, replace_value, set_key
from swarmctl.spec.layout import layout
from swarmctl.spec.literals import literal
from swarmctl.spec.source import Source, parse
from written import DATA, KEYS, SPECS, WORDS, Writer

Loc = tuple[str | int, ...]


def read(text: str) -> Source:
    source, found = parse(text, "swarm.yaml")
    assert found == []
    return source


def places(data: Any, loc: Loc = ()) -> Iterator[Loc]:
    yield loc
    below = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, tuple) else ()
    for step, value in below:
        yield from places(value, (*loc, step))


def at(data: Any, loc: Loc) -> Any:
    for step in loc:
        data = data[step]
    return data


def with_at(data: Any, loc: Loc, value: Any) -> Any:
    """``data`` with another value at ``loc``."""
    if not loc:
        return value
    if isinstance(data, dict):
        return {key: with_at(one, loc[1:], value) if key == loc[0] else one for key, one in data.items()}
    return tuple(with_at(one, loc[1:], value) if place == loc[0] else one for place, one in enumerate(data))


def assert_says(text: str, edits: Edits, expected: Any) -> None:
    """The text with the edits says ``expected``, in the same order, and no other line has changed."""
    changed = apply(text, edits)
    source = read(changed)
    assert source.data == expected, changed
    assert repr(source.data) == repr(expected)
    before, after = text.splitlines(keepends=True), changed.splitlines(keepends=True)
    touched = {line for edit in edits for line in range(edit.span.line, edit.span.end_line + 1)}
    left = [line.rstrip("\r\n") for number, line in enumerate(before, 1) if number not in touched]
    remaining = iter(line.rstrip("\r\n") for line in after)
    assert all(line in remaining for line in left)
    assert ("\r\n" in text) == ("\r\n" in changed) or text.count("\n") <= 1 or changed.count("\n") == 0
    assert "\r\n" not in text or changed.count("\n") == changed.count("\r\n")


random_specs = st.tuples(SPECS, st.randoms(use_true_random=False))


@given(random_specs)
def test_the_layout_knows_every_node(drawn: tuple[dict[str, Any], random.Random]) -> None:
    text = Writer(drawn[1]).document(drawn[0])
    source = read(text)
    assert source.data == drawn[0]
    found = layout(text)

    def walk(node: yaml.Node) -> None:
        part = found.parts[node.start_mark.index, node.id]  # type: ignore[index]
        if isinstance(node, yaml.MappingNode):
            for key, value in node.value:
                assert found.keys[key.start_mark.index][0] is part
                walk(value)
        elif isinstance(node, yaml.SequenceNode):
            for number, item in enumerate(node.value):
                assert found.items[item.start_mark.index] == (part, number)
                walk(item)
        else:
            assert part.value == node.value

    assert source.root is not None
    walk(source.root)


@settings(max_examples=300)
@given(random_specs, DATA, st.data())
def test_a_value_is_replaced(
    drawn: tuple[dict[str, Any], random.Random], value: Any, choose: st.DataObject
) -> None:
    data, chance = drawn
    text = Writer(chance).document(data)
    loc = choose.draw(st.sampled_from([loc for loc in places(data) if loc]))
    assert_says(text, replace_value(read(text), loc, value), with_at(data, loc, value))


@settings(max_examples=300)
@given(random_specs, KEYS, DATA, st.data())
def test_a_key_is_added(
    drawn: tuple[dict[str, Any], random.Random], key: str, value: Any, choose: st.DataObject
) -> None:
    data, chance = drawn
    text = Writer(chance).document(data)
    loc = choose.draw(st.sampled_from([loc for loc in places(data) if isinstance(at(data, loc), dict)]))
    mapping = at(data, loc)
    block = not loc and isinstance(value, (dict, tuple))  # such a one goes to the end of the file
    after = "" if block else choose.draw(st.sampled_from(["", *mapping]))
    place = list(mapping).index(after) + 1 if after in mapping else len(mapping)
    pairs = list(mapping.items())
    expected = dict([*pairs[:place], (key, value), *pairs[place:]]) | {key: value}
    if key in mapping:
        expected = mapping | {key: value}
    assert_says(text, set_key(read(text), loc, key, value, after=after), with_at(data, loc, expected))


@settings(max_examples=300)
@given(random_specs, DATA, st.data())
def test_an_item_is_appended(
    drawn: tuple[dict[str, Any], random.Random], value: Any, choose: st.DataObject
) -> None:
    data, chance = drawn
    data = {**data, "items": ("one", *data)}
    text = Writer(chance).document(data)
    loc = choose.draw(st.sampled_from([loc for loc in places(data) if isinstance(at(data, loc), tuple)]))
    assert_says(text, append_item(read(text), loc, value), with_at(data, loc, (*at(data, loc), value)))


@settings(max_examples=300)
@given(random_specs, st.data())
def test_an_entry_is_removed(drawn: tuple[dict[str, Any], random.Random], choose: st.DataObject) -> None:
    data, chance = drawn
    text = Writer(chance).document(data)
    *above, gone = choose.draw(st.sampled_from([loc for loc in places(data) if loc]))
    holder = at(data, tuple(above))
    left: Any = (
        {key: value for key, value in holder.items() if key != gone}
        if isinstance(holder, dict)
        else tuple(value for number, value in enumerate(holder) if number != gone)
    )
    assert_says(text, remove(read(text), (*above, gone)), with_at(data, tuple(above), left))


@settings(max_examples=200)
@given(random_specs, KEYS, st.data())
def test_a_key_is_renamed(
    drawn: tuple[dict[str, Any], random.Random], name: str, choose: st.DataObject
) -> None:
    data, chance = drawn
    text = Writer(chance).document(data)
    *above, old = choose.draw(
        st.sampled_from([loc for loc in places(data) if loc and isinstance(loc[-1], str)])
    )
    mapping = at(data, tuple(above))
    if name in mapping:
        return
    renamed = {name if key == old else key: value for key, value in mapping.items()}
    assert_says(text, rename_key(read(text), (*above, old), name), with_at(data, tuple(above), renamed))


@given(DATA)
def test_a_literal_is_the_same_to_readers_of_yaml_1_1_and_1_2(value: Any) -> None:
    for written in (literal(value), f"[{literal(value)}]"[1:-1]):
        assert read(f"a: {written}\n").data == {"a": value}
        assert _tuples(yaml.safe_load(f"a: {written}\n")) == {"a": value}


def _tuples(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _tuples(value) for key, value in data.items()}
    return tuple(map(_tuples, data)) if isinstance(data, list) else data


@pytest.mark.parametrize(
    ("written", "quote", "expected"),
    [
        ("100000000000", "", '"100000000000"'),
        ("10:00:e8:c5:64:37", "", '"10:00:e8:c5:64:37"'),
        ("10:00:e8:c5:64:37", "'", "'10:00:e8:c5:64:37'"),
        ("no", "", '"no"'),
        ("Y", "", '"Y"'),
        ("012", "", '"012"'),
        ("2026-01-01", "", '"2026-01-01"'),
        ("192.168.77.10", "", "192.168.77.10"),
        ("192.168.77.0/24", "", "192.168.77.0/24"),
        ("/dev/ttyS0", "", "/dev/ttyS0"),
        ("it's", "'", "'it''s'"),
        ("a: b # c", "", '"a: b # c"'),
        ("two\nlines", "'", '"two\\nlines"'),
    ],
)
def test_text_has_quotes_where_it_needs_them(written: str, quote: str, expected: str) -> None:
    assert literal(written, quote) == expected
