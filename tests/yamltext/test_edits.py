"""A change of a spec's text changes what it says, and nothing else that stands there."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.diagnostics import has_errors
from swarmctl.yamltext.cst import layout
from swarmctl.yamltext.edits import (
    Edits,
    append_item,
    apply,
    make_fix,
    remove,
    rename_key,
    replace_value,
    set_key,
)
from swarmctl.yamltext.scalars import literal
from swarmctl.yamltext.source import Source, parse
from tests.spec.written import DATA, KEYS, SPECS, Writer

Loc = tuple[str | int, ...]


def read(text: str) -> Source:
    source, found = parse(text, "swarm.yaml")
    assert not has_errors(found)
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


@given(random_specs, DATA, st.data())
def test_a_value_is_replaced(
    drawn: tuple[dict[str, Any], random.Random], value: Any, choose: st.DataObject
) -> None:
    data, chance = drawn
    text = Writer(chance).document(data)
    loc = choose.draw(st.sampled_from([loc for loc in places(data) if loc]))
    assert_says(text, replace_value(read(text), loc, value), with_at(data, loc, value))


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


@given(random_specs, DATA, st.data())
def test_an_item_is_appended(
    drawn: tuple[dict[str, Any], random.Random], value: Any, choose: st.DataObject
) -> None:
    data, chance = drawn
    data = {**data, "items": ("one", *data)}
    text = Writer(chance).document(data)
    loc = choose.draw(st.sampled_from([loc for loc in places(data) if isinstance(at(data, loc), tuple)]))
    edits = append_item(read(text), loc, value)
    if edits or not any("!" in str(one) for one in at(data, loc)):  # `!k3` leaves a name out
        assert_says(text, edits, with_at(data, loc, (*at(data, loc), value)))


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


@pytest.mark.parametrize(
    ("text", "change", "expected"),
    [
        pytest.param(
            "hosts:\n  a: {user: robot}  # the lab's\n\n# end\n",
            lambda source: set_key(source, ("hosts",), "b", {"user": "pi"}),
            "hosts:\n  a: {user: robot}  # the lab's\n  b: {user: pi}\n\n# end\n",
            id="behind the comment of the last one",
        ),
        pytest.param(
            "mode: leader # 2\nhosts: {}\n",
            lambda source: set_key(source, (), "leader", "a", after="mode"),
            "mode: leader # 2\nleader: a\nhosts: {}\n",
            id="behind a key",
        ),
        pytest.param(
            "name: lab\n\nhosts:\n  a: {}\n",
            lambda source: set_key(source, (), "links", [{"kind": "wlan", "hosts": ["a"]}]),
            "name: lab\n\nhosts:\n  a: {}\n\nlinks:\n  - {kind: wlan, hosts: [a]}\n",
            id="a block of its own",
        ),
        pytest.param(
            "a: {\n  b: 1,   # one\n  c: 2    # two\n}\n",
            lambda source: set_key(source, ("a",), "d", 3),
            "a: {\n  b: 1,   # one\n  c: 2,    # two\n  d: 3\n}\n",
            id="brackets over several lines",
        ),
        pytest.param(
            "a: [\n\tb,  # one\n\tc,\n]",
            lambda source: append_item(source, ("a",), "d"),
            "a: [\n\tb,  # one\n\tc,\n\td,\n]",
            id="a comma behind the last one, tabs, no end of line",
        ),
        pytest.param(
            '{"a": {"b": 1}}',
            lambda source: set_key(source, ("a",), "c", "x"),
            '{"a": {"b": 1, "c": "x"}}',
            id="keys in quotes",
        ),
        pytest.param(
            "a:  # nothing yet\nb: 1",
            lambda source: append_item(source, ("a",), "x"),
            "a: [x]  # nothing yet\nb: 1",
            id="a list where nothing stood",
        ),
        pytest.param(
            "a: {}",
            lambda source: set_key(source, (), "b", 1),
            "a: {}\nb: 1",
            id="the last line has no end",
        ),
        pytest.param(
            "links:\n- kind: serial  # usb\n  host: a\n- x\n",
            lambda source: remove(source, ("links", 0, "kind")),
            "links:\n- host: a\n- x\n",
            id="the first key of an item",
        ),
        pytest.param(
            "a:  # of the lab\n  b: 1  # one\n  # two\nc: 3\n",
            lambda source: remove(source, ("a", "b")),
            "a: {}  # of the lab\n  # two\nc: 3\n",
            id="the only key",
        ),
        pytest.param(
            "a: [b, c,]\n",
            lambda source: remove(source, ("a", 1)),
            "a: [b,]\n",
            id="the last item before a comma",
        ),
        pytest.param(
            "a: &x !!str 'b'  # c\n",
            lambda source: replace_value(source, ("a",), "d"),
            "a: &x !!str 'd'  # c\n",
            id="anchor, tag and quotes stay",
        ),
        pytest.param(
            "hosts:\n  # first\n  a:\n    user: x\n\n  # second\n  b: 1\n",
            lambda source: replace_value(source, ("hosts", "a"), {"user": "pi"}),
            "hosts:\n  # first\n  a: {user: pi}\n\n  # second\n  b: 1\n",
            id="a block becomes a line",
        ),
        pytest.param(
            "a: 1\r\nb: |+\r\n  x\r\n\r\nc: 2\r\n",
            lambda source: set_key(source, (), "d", 3, after="a"),
            "a: 1\r\nd: 3\r\nb: |+\r\n  x\r\n\r\nc: 2\r\n",
            id="ends of lines as the file has them",
        ),
    ],
)
def test_the_text_looks_as_one_would_have_written_it(
    text: str, change: Callable[[Source], Edits], expected: str
) -> None:
    assert apply(text, change(read(text))) == expected


ANCHORED = "a: &x {b: [one]}\nc: *x\nd: [k: 1]\n? e\n: 1\n"


@pytest.mark.parametrize(
    "change",
    [
        lambda source: replace_value(source, ("a", "b", 0), "two"),
        lambda source: append_item(source, ("c", "b"), "two"),
        lambda source: set_key(source, ("c",), "e", 1),
        lambda source: remove(source, ("a",)),
        lambda source: set_key(source, ("d", 0), "l", 1),
        lambda source: set_key(source, (), "f", 1),
        lambda source: remove(source, ("nowhere",)),
        lambda source: append_item(source, ("d", 0, "k"), 1),
    ],
)
def test_a_change_that_would_change_more_or_is_not_understood_is_none(
    change: Callable[[Source], Edits],
) -> None:
    source = read(ANCHORED)
    assert change(source) == ()
    assert make_fix("cannot be", replace_value(source, ("d",), 1), change(source), safe=True) is None


def test_changes_of_the_same_text_make_no_fix() -> None:
    source = read("a: {b: 1, c: 2, d: 3}\n")
    assert make_fix("x", remove(source, ("a", "c")), remove(source, ("a", "d")), safe=True) is None
    apart = make_fix("x", remove(source, ("a", "b")), remove(source, ("a", "d")), safe=True)
    assert apart is not None
    assert apply(source.texts["swarm.yaml"], apart.edits) == "a: {c: 2}\n"


def test_edits_of_the_same_text_are_refused() -> None:
    source = read("a: [b, c]\n")
    with pytest.raises(ValueError, match="two edits overlap"):
        apply(source.texts["swarm.yaml"], [*replace_value(source, ("a", 0), "x"), *remove(source, ("a", 0))])
    both = [*append_item(source, ("a",), "d"), *append_item(source, ("a",), "e")]
    assert apply(source.texts["swarm.yaml"], both) == "a: [b, c, d, e]\n"
