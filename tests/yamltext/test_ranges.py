"""Ranges: what they write out equals what a patient hand would write, and nothing else changes."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.diagnostics import Diagnostic
from swarmctl.links.bluetooth_link import Bluetooth
from swarmctl.linter.runner import lint
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import Document, load, load_text
from swarmctl.yamltext import edits, hostlist, ranges
from swarmctl.yamltext.compose import compose
from swarmctl.yamltext.files import LoadBudget
from swarmctl.yamltext.hostlist import NoRange, Range
from swarmctl.yamltext.source import source_of
from tests import ROOT
from tests.timing import work_at_most

CATALOG = load_catalog()

PI = "computer: raspberry-pi-4b, bluetooth: [hci0]"
PAGE = (ROOT / "docs/spec.md").read_text("utf-8")
TWENTY = next(block for block in re.findall(r"(?s)```yaml\n(.*?)```", PAGE) if "name: twenty-epucks" in block)


def written_by_hand() -> str:
    """The same swarm without a range."""
    hosts = [f"  pi-{n}: {{address: 192.168.77.{10 + n}, {PI}}}" for n in range(1, 6)]
    robots = [f"  epuck-{n:02}: {{type: epuck, host: pi-{(n - 1) % 5 + 1}}}" for n in range(1, 21)]
    links = [
        f"  - {{kind: bluetooth, host: pi-{(n - 1) % 5 + 1}, robot: epuck-{n:02}, "
        f"mac: '10:00:e8:c5:64:{n:02}'}}"
        for n in range(1, 21)
    ]
    instead = {"  pi-[1-5]:": hosts, "  epuck-[01-20]:": robots, "  - {kind: bluetooth": links}
    lines: list[str] = []
    for line in TWENTY.splitlines():
        ranging = next((written for start, written in instead.items() if line.startswith(start)), [line])
        lines += [one.replace('"pi-[1-5]"', "pi-1, pi-2, pi-3, pi-4, pi-5") for one in ranging]
    return "\n".join(lines) + "\n"


def data_of(text: str) -> tuple[Any, list[Diagnostic]]:
    """What a text says with its ranges written out, and what is wrong with them."""
    root, problem = compose(text, "swarm.yaml", LoadBudget())
    assert problem is None
    made, found = ranges.expand(root)
    return source_of(made, "swarm.yaml", {})[0].data, found


def loaded(text: str) -> Document:
    document, found = load_text(text, "swarm.yaml", CATALOG)
    assert found == ()
    assert document is not None
    return document


def codes(text: str) -> list[str]:
    return [one.code for one in data_of(text)[1]]


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("epuck-[01-03]", "epuck-01 epuck-02 epuck-03"),
        ("epuck-[1-3,5]", "epuck-1 epuck-2 epuck-3 epuck-5"),
        ("epuck-[8-11]", "epuck-8 epuck-9 epuck-10 epuck-11"),
        ("epuck-[08-11]", "epuck-08 epuck-09 epuck-10 epuck-11"),
        ("epuck-[099-101]", "epuck-099 epuck-100 epuck-101"),
        ("pi-[7]", "pi-7"),
        ("pi-[2,1]", "pi-2 pi-1"),
        ("pi-[1-2, 4]", "pi-1 pi-2 pi-4"),
        ("pi-[1-2,1-2,1-2]", "pi-1 pi-2 pi-1 pi-2 pi-1 pi-2"),
        ("pi-[1,1,2]", "pi-1 pi-1 pi-2"),
        ("pi-[1-2,1-2]", "pi-1 pi-2 pi-1 pi-2"),
        ("[1-2].robots.example", "1.robots.example 2.robots.example"),
        ("10:00:[10-11]:00", "10:00:10:00 10:00:11:00"),
    ],
)
def test_a_range_counts_as_in_slurm_and_pdsh(text: str, names: str) -> None:
    found = hostlist.read(text)
    assert isinstance(found, Range)
    assert found.names == tuple(names.split())


@pytest.mark.parametrize("text", ["epuck", "", "1-20", "]", "[fe80::1]", "\x1b[31mred"])
def test_what_is_no_range_is_text(text: str) -> None:
    assert hostlist.read(text) is None


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("a[", "RANGE001"), ("a[]", "RANGE001"), ("a[1", "RANGE001"), ("a[x]", "RANGE001"),
        ("a[1-]", "RANGE001"),
        ("a[-1]", "RANGE001"), ("a[1,]", "RANGE001"), ("a[1*]", "RANGE001"), ("a[1*0]", "RANGE001"),
        ("a[[1-2]]", "RANGE001"), ("a[٣-٤]", "RANGE001"), ("a[2-1]", "RANGE002"), ("a[02-01]", "RANGE002"),
        ("a[1-10001]", "RANGE003"), ("a[1-999999999]", "RANGE003"), ("a[1*999999999]", "RANGE001"),
        ("a[1-2]b[1-2]", "RANGE004"), ("a[1-2][1-2]", "RANGE004"),
    ],
)  # fmt: skip
def test_what_makes_no_range_says_why(text: str, code: str) -> None:
    found = hostlist.read(text)
    assert isinstance(found, NoRange)
    assert found.code == code
    assert found.help


@pytest.mark.parametrize(
    ("text", "instead"),
    [("pi-[1-5*4]", "[1-5,1-5,1-5,1-5]"), ("pi-[1-2,7*2]", "[7,7]"), ("pi-[1-5*400]", "[1-5,1-5]")],
)
def test_a_multiplied_part_is_an_error_with_a_remedy(text: str, instead: str) -> None:
    found = hostlist.read(text)
    assert isinstance(found, NoRange)
    assert "a range has no `*`" in found.message
    assert found.help == f"repeat the part instead: {instead}"


numbers = st.integers(0, 1200)
parts = st.builds(
    lambda first, count, width, times: (first, first + count, width, times),
    numbers, st.integers(0, 30), st.integers(1, 5), st.integers(1, 4),
)  # fmt: skip


@given(
    st.lists(parts, min_size=1, max_size=4),
    st.sampled_from(["", "epuck-", "192.168.7."]),
    st.sampled_from(["", "-x"]),
)
def test_a_range_has_as_many_names_as_its_parts_count_and_pads_them(
    given_parts: list[tuple[int, int, int, int]], head: str, tail: str
) -> None:
    written = ",".join(
        f"{first:0{width}}-{last}" for first, last, width, times in given_parts for _ in range(times)
    )
    found = hostlist.read(f"{head}[{written}]{tail}")
    assert isinstance(found, Range)
    assert len(found.names) == sum((last - first + 1) * times for first, last, _, times in given_parts)
    padded = [
        f"{head}{number:0{max(width, len(str(first)))}}{tail}"
        for first, last, width, times in given_parts
        for _ in range(times)
        for number in range(first, last + 1)
    ]
    assert list(found.names) == padded


@given(st.lists(parts, min_size=1, max_size=4), st.sets(st.integers(0, 150), max_size=20))
def test_a_range_that_leaves_names_out_has_all_the_others(
    given_parts: list[tuple[int, int, int, int]], places: set[int]
) -> None:
    whole = hostlist.read(f"e[{','.join(f'{first}-{last}' for first, last, _, _ in given_parts)}]")
    assert isinstance(whole, Range)
    gone = {name for place, name in enumerate(whole.names) if place in places}
    kept = tuple(name for name in whole.names if name not in gone)
    rest = hostlist.read(whole.without(gone)) if kept else None
    assert (rest.names if isinstance(rest, Range) else ()) == kept


def test_twenty_robots_on_five_hosts_are_what_a_hand_would_write() -> None:
    short, long = loaded(TWENTY), loaded(written_by_hand())
    assert len(TWENTY.splitlines()) == 12
    assert len(short.spec.robots) == 20
    assert short.spec == long.spec
    assert list(short.spec.robots) == list(long.spec.robots)
    assert lint(short) == ()


def test_an_overlay_may_name_one_of_many(tmp_path: Path) -> None:
    (tmp_path / "swarm.yaml").write_text(TWENTY, "utf-8")
    (tmp_path / "today.yaml").write_text(
        "robots:\n  epuck-07: {optional: true}\n  epuck-[19-20]: ~\n"
        "links:\n  - {robot: epuck-07, mac: '10:00:00:00:00:07'}\n  - {robot: 'epuck-[19-20]', kind: ~}\n",
        "utf-8",
    )
    document, found = load((tmp_path / "swarm.yaml", tmp_path / "today.yaml"))
    assert found == ()
    assert document is not None
    robots = document.spec.robots
    assert [name for name, robot in robots.items() if robot.optional] == ["epuck-07"]
    assert (robots["epuck-07"].host, list(robots)[-1]) == ("pi-2", "epuck-18")
    macs = {link.robot: link.mac for link in document.spec.links if isinstance(link, Bluetooth)}
    assert (len(macs), macs["epuck-07"], macs["epuck-08"]) == (18, "10:00:00:00:00:07", "10:00:e8:c5:64:08")


def test_each_robot_has_its_own_values() -> None:
    robots = loaded(TWENTY).spec.robots
    assert [robots[f"epuck-{n:02}"].host for n in (1, 4, 5, 20)] == [
        "pi-1", "pi-4", "pi-5", "pi-5",
    ]  # fmt: skip


def test_a_place_points_at_the_entry_that_was_written() -> None:
    document = loaded(TWENTY)
    lines = TWENTY.splitlines()
    for name in ("epuck-01", "epuck-20"):
        span = document.span("robots", name, key=True)
        assert lines[span.line - 1][span.column - 1 : span.end_column - 1] == "epuck-[01-20]"
        span = document.span("robots", name, "host")
        assert lines[span.line - 1][span.column - 1 : span.end_column - 1] == '"pi-[1-5,1-5,1-5,1-5]"'
    assert lines[document.span("links", 20, "mac").line - 1].endswith('[01-20]"}')


def test_a_finding_names_the_robot_that_it_is_about() -> None:
    (found,) = lint(loaded(TWENTY.replace("e8:c5:64:[01-20]", "e8:c5:64:[01-19,01]")))
    assert "epuck-01" in found.message + found.label + "".join(note.text for note in found.notes)


def test_an_edit_counts_the_entries_that_a_range_makes_of_its_text() -> None:
    source = loaded(TWENTY).source
    for place in (
        ("robots", "epuck-07"),
        ("links", 1),
        ("links", 7),
        ("links", 20),
        ("links", 0, "hosts", 2),
    ):
        assert edits.remove(source, place) == ()
    assert edits.rename_key(source, ("robots", "epuck-07"), "epuck") == ()
    for place, copies in ((("robots", "epuck-07"), 20), (("hosts", "pi-1"), 5), (("links", 7), 20)):
        assert [edit.copies for edit in edits.set_key(source, place, "optional", True)] == [copies]
    for_all = [
        edits.replace_value(source, ("robots", f"epuck-{n:02}", "type"), "epuck2") for n in range(1, 21)
    ]
    assert [edit.copies for edit in edits.joined(for_all)] == [1]
    assert [edit.copies for edit in edits.joined(for_all[:19])] == [20]
    assert edits.set_key(source, ("hosts", "laptop"), "user", "robot") != ()
    assert edits.append_item(source, ("links", 0, "hosts"), "other") != ()


@pytest.mark.parametrize(
    ("text", "data"),
    [
        # a key
        ("hosts:\n  pi-[1-2]:\n    port: 220[1-2]",
         {"hosts": {"pi-1": {"port": 2201}, "pi-2": {"port": 2202}}}),
        ('hosts:\n  pi-[1-2]: {port: "220[1-2]"}',
         {"hosts": {"pi-1": {"port": "2201"}, "pi-2": {"port": "2202"}}}),
        ("hosts:\n  a-[1-2]: {x: {each: [p, 7]}}", {"hosts": {"a-1": {"x": "p"}, "a-2": {"x": 7}}}),
        ("hosts:\n  a-[1-2]: {x: {each: [{y: 1}, {y: 2}]}}",
         {"hosts": {"a-1": {"x": {"y": 1}}, "a-2": {"x": {"y": 2}}}}),
        ('hosts:\n  a-[1-3]: {x: {each: [b, "c[1-2]"]}}',
         {"hosts": {"a-1": {"x": "b"}, "a-2": {"x": "c1"}, "a-3": {"x": "c2"}}}),
        ('hosts:\n  a-[1-2]: {x: ["b[1-2]", c]}',
         {"hosts": {"a-1": {"x": ("b1", "c")}, "a-2": {"x": ("b2", "c")}}}),
        ("hosts:\n  a-[1-1]: {}", {"hosts": {"a-1": {}}}),
        ("hosts:\n  z: 1\n  a-[2,1]: 2\n  b: 3", {"hosts": {"z": 1, "a-2": 2, "a-1": 2, "b": 3}}),
        # an item of a list
        ('of: [x, "e[1-2]", y]', {"of": ("x", "e1", "e2", "y")}),
        ('links: [{a: 1}, {a: "e[1-2]", b: {c: {each: [p, q]}}, d: 4}]',
         {"links": ({"a": 1}, {"a": "e1", "b": {"c": "p"}, "d": 4}, {"a": "e2", "b": {"c": "q"}, "d": 4})}),
        ('links: [{hosts: ["e[1-2]", f]}]', {"links": ({"hosts": ("e1", "e2", "f")},)}),
        ('control: [{by: "j[1-2]", of: ["e[1-2]"]}]',
         {"control": ({"by": "j1", "of": ("e1",)}, {"by": "j2", "of": ("e2",)})}),
        # text that only looks like it
        ('programs: {p: {params: {a: "x[1-2]", b: "[a-z]"}}}',
         {"programs": {"p": {"params": {"a": "x[1-2]", "b": "[a-z]"}}}}),
        ('programs:\n  p-[1-2]: {params: {a: "x[1-2]", b: "c[a-z]"}}',
         {"programs": {"p-1": {"params": {"a": "x1", "b": "c[a-z]"}},
                       "p-2": {"params": {"a": "x2", "b": "c[a-z]"}}}}),
        ('ignore: [{rule: A, reason: "see [1]"}]', {"ignore": ({"rule": "A", "reason": "see [1]"},)}),
        ('types: {a: {title: "x[1-2]"}}', {"types": {"a": {"title": "x[1-2]"}}}),
    ],
)  # fmt: skip
def test_what_is_written_out(text: str, data: Any) -> None:
    assert data_of(text) == (data, [])


def test_order_is_that_of_the_text() -> None:
    data, _ = data_of("hosts:\n  z: 1\n  a-[2,1]: 2\n  b: 3")
    assert list(data["hosts"]) == ["z", "a-2", "a-1", "b"]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("hub: a-[1-2]", ["RANGE006"]),
        ("hosts: {a: {address: {each: [b, c]}}}", ["RANGE006"]),
        ("of: [{each: [b, c]}]", ["RANGE006"]),
        ('hosts:\n  a-[1-2]: {address: "b-[1-3]"}', ["RANGE005"]),
        ("hosts:\n  a-[1-2]: {address: {each: [b]}}", ["RANGE005"]),
        ("hosts:\n  a-[1-2]: {address: {each: []}}", ["RANGE005"]),
        ('links: [{a: "b-[1-2]", c: "d-[1-3]", e: "f-[1-4]"}]', ["RANGE005", "RANGE005"]),
        ("hosts:\n  a-[1-3]: 1\n  a-2: 2", ["YAML002"]),
        ("hosts:\n  a-2: 2\n  a-[1-3]: 1", ["YAML002"]),
        ("hosts:\n  a-[1-3]: 1\n  a-[2-9]: 2", ["YAML002"]),
        ("hosts:\n  a-[1,1]: 1", ["YAML002"]),
    ],
)  # fmt: skip
def test_an_error_is_reported_once(text: str, found: list[str]) -> None:
    assert codes(text) == found


words = st.text("abcx:. -", max_size=6)
trees = st.recursive(
    st.one_of(words, st.integers(), st.booleans()),
    lambda below: st.one_of(st.lists(below, max_size=4), st.dictionaries(words, below, max_size=4)),
    max_leaves=20,
)


@given(st.dictionaries(words, trees, max_size=5))
def test_without_ranges_nothing_is_made(data: dict[str, Any]) -> None:
    root, problem = compose(yaml.safe_dump(data), "x", LoadBudget())
    assert problem is None
    made, found = ranges.expand(root)
    assert made is root
    assert found == []


def test_what_is_written_out_holds_no_range() -> None:
    root, _ = compose(TWENTY, "x", LoadBudget())
    once, _ = ranges.expand(root)
    twice, found = ranges.expand(once)
    assert twice is once
    assert found == []


@pytest.mark.parametrize("text", [TWENTY, "a: b-[1-2]", 'a: "[1].x"x[', "a: {each: [b]}"])
def test_the_quick_look_misses_no_range(text: str) -> None:
    assert ranges.may_stand_in(text)


def test_the_quick_look_passes_over_lists() -> None:
    assert not ranges.may_stand_in("a: [b, [c, d]]\ne:\n  - [f]\ng: {h: [i], j: [[1], [2]]}\n")


pieces = st.sampled_from(
    [
        "[",
        "]",
        "[1-3]",
        "[1-2,1-2]",
        "[9-1]",
        "{each: [a, b]}",
        "{each: []}",
        "*x",
        "&x ",
        "-",
        "[1-99999]",
        '"',
        ", ",
        "\n",
    ]
)


@settings(max_examples=300)
@given(st.lists(st.tuples(st.integers(0, len(TWENTY)), st.integers(0, 8), pieces), min_size=1, max_size=4))
def test_any_mutation_of_a_spec_with_ranges_gets_an_answer(cuts: list[tuple[int, int, str]]) -> None:
    text = TWENTY
    for place, length, word in cuts:
        text = text[:place] + word + text[place + length :]
    with work_at_most(100):
        document, found = load_text(text, "swarm.yaml", CATALOG)
    assert document is not None or found


LAYERS = "".join(
    f"{chr(98 + i)}: &{chr(98 + i)} {{{', '.join(f'{n}: *{chr(97 + i)}' for n in range(9))}}}\n"
    for i in range(20)
)
CHAIN = "".join(f"a{n}: &a{n} {{x: *a{n - 1}}}\n" for n in range(1, 3000))


@pytest.mark.parametrize(
    "text",
    [
        "".join(f'k{n}: ["x[1-10000]"]\n' for n in range(3000)),
        "hosts:\n  a-[1-10000]:\n" + "".join(f"    k{n}: x[1-10000]\n" for n in range(3000)),
        "hosts:\n  a-[1-10000]:\n" + "".join(f"    k{n}: {{}}\n" for n in range(3000)),
        f"a: &a {{x: 1}}\n{LAYERS}hosts:\n  a-[1-10]: *t\n",
        f'a: &a {{x: 1}}\n{LAYERS}links: [{{a: *t, b: "c-[1-3]"}}]\n',
        "hosts:\n  a-[1-10]: &a {b: *a}\n",
        'links: [&a {b: *a, c: "d-[1-3]"}]\n',
        f"a0: &a0 {{x: 1}}\n{CHAIN}h:\n  a-[1-2]: *a2999\n",
    ],
    ids=["lists", "values", "copies", "pyramid", "pyramid in a list", "circle", "circle in a list", "chain"],
)  # fmt: skip
def test_ranges_of_ranges_end_soon(text: str) -> None:
    with work_at_most(600):
        document, found = load_text(text, "swarm.yaml", CATALOG)
    assert document is None
    assert {"RANGE003", "YAML004", "YAML005", "YAML008"} & {one.code for one in found}


@pytest.mark.parametrize(
    ("names", "text"),
    [
        (["ep-01", "ep-02", "k3", "ep-04"], "ep-[01-02,04], k3"),
        (["10.0.0.9", "10.0.0.10"], "10.0.0.[9-10]"),
        (["desk"], "desk"),
        (["a1-pi", "a2-pi", "b"], "a[1-2]-pi, b"),
        ([], ""),
        (["pi", "pi2", "pi3"], "pi, pi[2-3]"),
        (["pi2", "pi"], "pi2, pi"),
    ],
)
def test_names_are_written_as_ranges(names: list[str], text: str) -> None:
    assert hostlist.written(names) == text
