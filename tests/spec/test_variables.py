"""Variables: a spec with them is the same spec as that in which each value is written out."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.mode_conversion.convert import converted
from swarmctl.spec.effective_spec import flat
from swarmctl.spec.load import Document, load, source_of_text
from swarmctl.spec.model import Mode
from swarmctl.spec.reach import reach_of
from swarmctl.views.effective_spec import yaml_of
from swarmctl.yamltext import edits
from swarmctl.yamltext.files import MAX_DEPTH
from tests import ROOT
from tests.loading import load_checked, load_swarm
from tests.timing import work_at_most

PAGE = (ROOT / "docs/spec.md").read_text("utf-8")
BLOCKS = re.findall(r"(?s)```yaml\n(.*?)```", PAGE)
LAB, FIELD, SIM = BLOCKS[
    (first := next(n for n, one in enumerate(BLOCKS) if "name: shared" in one)) : first + 3
]

PAIR = """\
version: 1
name: pair
mode: leader
leader: laptop
hosts:
  laptop: {address: 192.168.77.10, labels: [wide]}
  k3-pi: {address: 192.168.77.11}
robots:
  koala: {type: koala, host: laptop}
  k3: {type: khepera3, host: k3-pi}
  k4: {type: khepera3, host: k3-pi}
links:
  - {kind: ethernet, name: lab, hosts: [laptop, k3-pi]}
  - {kind: serial, host: laptop, robot: koala, usb: {serial: A600dXyz}}
  - {kind: serial, host: k3-pi, robot: k3, usb: {serial: FTDI1234}}
  - {kind: serial, host: k3-pi, robot: k4, usb: {serial: FTDI1235}}
programs:
  all: {robots: ["*"], command: [run, "v=${v}"]}
  here: {host: k3-pi, command: [run, "v=${v}"]}
"""


def written(folder: Path, *texts: str) -> list[Path]:
    files = [folder / f"{number}.yaml" for number in range(len(texts))]
    for file, text in zip(files, texts, strict=True):
        file.write_text(text, "utf-8")
    return files


def document(folder: Path, *texts: str) -> Document:
    made, found = load(written(folder, *texts))
    assert made is not None, found
    return made


def by_hand(net: str, koala: str, k3: str, sim: str) -> str:
    text = re.sub(r"(?s)^vars:.*?(?=^hosts:)", "", LAB, flags=re.MULTILINE)
    text = re.sub(r", vars: \{.*?\}", "", text).replace("${net}", net)
    text = text.replace('"${speed}"', koala, 1).replace('"${speed}"', k3)
    programs = "".join(
        f"  map-{robot}: {{robot: {robot}, package: map_server, executable: map_server, "
        f"args: [/maps/{one}.yaml], optional: {sim}}}\n"
        for robot, one in (("koala", "yard"), ("k3", "hall"))
    )
    return re.sub(r"(?m)^  map: .*\n", programs, text)


@pytest.mark.parametrize(
    ("over", "values"),
    [
        ((), ("192.168.77", "0.3", "0.1", "false")),
        ((FIELD,), ("10.0.5", "0.4", "0.1", "false")),
        ((SIM,), ("10.99.0", "0.1", "0.1", "true")),
    ],
    ids=["lab", "field", "sim"],
)
def test_the_example_of_the_page(over: tuple[str, ...], values: tuple[str, ...], tmp_path: Path) -> None:
    made, found = load_swarm(*written(tmp_path, LAB, *over))
    assert found == ()
    plain, _ = load_swarm(*written(tmp_path, by_hand(*values)))
    assert made is not None
    assert plain is not None
    assert (made.robots, made.hosts, made.programs) == (plain.robots, plain.hosts, plain.programs)
    shown, as_written = (
        yaml_of(flat(document(tmp_path, *texts))) for texts in ((LAB, *over), (by_hand(*values),))
    )
    assert shown == as_written


SCALARS = st.one_of(st.integers(), st.booleans(), st.text(st.characters(codec="ascii"), max_size=8))


@given(st.one_of(SCALARS, st.lists(SCALARS, max_size=3)))
def test_a_value_keeps_its_type(value: Any) -> None:
    text = json.dumps(value)
    plain = source_of_text(f"vars: {{v: 1}}\nx: {text}\n", "a.yaml").data["x"]
    assert source_of_text(f"vars: {{v: {text}}}\nx: ${{v}}\n", "a.yaml").data["x"] == plain


@given(st.text("${}abA:-1 ", max_size=12))
def test_other_text_stays(text: str) -> None:
    """In a spec without variables every text does."""
    line = f"x: {json.dumps(text)}\n"
    assert source_of_text(line, "a.yaml").data == {"x": text}
    if not re.search(r"\$\$\{|\$\{[a-z]", text):
        assert source_of_text(f"vars: {{v: 1}}\n{line}", "a.yaml").data["x"] == text


@pytest.mark.parametrize(
    ("value", "text", "made"),
    [
        ("22", "${v}", 22),
        ("22", "'${v}'", 22),
        ("'22'", "${v}", "22"),
        ("22", "1${v}", 122),
        ("22", "'1${v}'", "122"),
        ("0.50", "a${v}", "a0.50"),
        ("''", "${v}", ""),
        ("''", "${v}${v}", ""),
        ("a", "$${v}", "${v}"),
        ("a", "$$${v}", "$${v}"),
        ("a", "${v}$${v}${V}${v:-b}", "a${v}${V}${v:-b}"),
        ("a", "{k: ['${v}']}", {"k": ("a",)}),
        ("[1, b]", "${v}", (1, "b")),
    ],
)
def test_a_value_in_a_text(value: str, text: str, made: object) -> None:
    data = source_of_text(f"vars: {{w: {value}, v: '${{w}}'}}\nx: {text}\n", "a.yaml").data
    assert data["x"] == made
    assert type(data["x"]) is type(made)


@pytest.mark.parametrize(
    ("given", "values"),
    [
        ("vars: {v: 1}", "1 1 1 1"),
        ("vars: {v: {default: 1, k3: 3}}", "1 3 1 1"),
        ("vars: {v: {default: 1, k3: 3, k3-pi: 4}}", "1 3 4 4"),
        ("vars: {v: {default: 1, '@wide': 5, 'type:khepera3': 6}}", "5 6 6 1"),
        ("vars: {v: {default: 1, '*': 7, '!k3-pi': 7}}", "7 7 7 7"),
        ("vars: {v: 1}\nhosts: {k3-pi: {vars: {v: 2}}}", "1 2 2 2"),
        ("vars: {v: 1}\nhosts: {k3-pi: {vars: {v: 2}}}\nrobots: {k3: {vars: {v: 3}}}", "1 3 2 2"),
        ("vars: {v: 1}\nprograms: {all: {vars: {v: 8}}}", "8 8 8 1"),
        ("vars: {v: '${w}', w: {default: 1, k3: 3}}", "1 3 1 1"),
        (
            "vars: {v: 1, d: k3-pi}\nrobots: {koala: {host: laptop}, k4: {host: '${d}', vars: {v: 4}}}",
            "1 1 4 1",
        ),
    ],
)
def test_the_most_special_value_holds(given: str, values: str, tmp_path: Path) -> None:
    programs = document(tmp_path, PAIR, given).spec.programs
    names = ("all-koala", "all-k3", "all-k4", "here")
    assert " ".join((programs[name].command or ())[1][2:] for name in names) == values


def test_each_of_a_range_has_the_values_of_its_entry(tmp_path: Path) -> None:
    over = """
vars: {net: 192.168.77}
hosts:
  pi-[1-3]: {address: "${net}.2[1-3]", user: "${who}", vars: {who: {each: [ann, bob, eve]}}}
links:
  - {name: lab, hosts: [laptop, k3-pi, "pi-[1-3]"], subnet: "${net}.0/24"}
"""
    hosts = document(tmp_path, PAIR.replace("${v}", ""), over).spec.hosts
    assert [(hosts[f"pi-{n}"].address[-2:], hosts[f"pi-{n}"].user) for n in (1, 2, 3)] == [
        ("21", "ann"), ("22", "bob"), ("23", "eve"),
    ]  # fmt: skip


def test_a_long_chain_of_variables_is_an_error(tmp_path: Path) -> None:
    chain = "".join(f"  v{n}: ${{v{n + 1}}}\n" for n in range(1, 10_000))
    found = load_checked(*written(tmp_path, PAIR, f"vars:\n  v: ${{v1}}\n{chain}  v10000: 1\n"))[1]
    assert [one.code for one in found] == ["VAR002"]
    assert str(MAX_DEPTH) in found[0].message


@pytest.mark.parametrize(
    "text",
    [
        "hosts:\n  h: &a {" + "".join(f"k{n}: '${{v}}', " for n in range(20_000)) + "}\n"
        + "".join(f"  h{n}: *a\n" for n in range(20_000)),
        "x0: &a0 ['${v}']\n" + "".join(f"x{n}: &a{n} [*a{n - 1}, *a{n - 1}]\n" for n in range(1, 40)),
        "robots:\n" + "".join(f"  r{n}: {{type: '${{w}}'}}\n" for n in range(10_000))
        + "vars:\n  v: 1\n  w:\n    default: a\n" + "".join(f"    r{n}*: b\n" for n in range(10_000)),
    ],
    ids=["aliases", "aliases of aliases", "selections"],
)  # fmt: skip
def test_a_hostile_spec_costs_little(text: str, tmp_path: Path) -> None:
    files = written(tmp_path, text if "vars:" in text else f"vars: {{v: 1}}\n{text}")
    with work_at_most(1000):
        assert load_checked(*files)[0] is None


@pytest.mark.parametrize(
    "edit",
    [
        lambda source: edits.replace_value(source, ("x", "a"), 3),
        lambda source: edits.as_text(source, ("x", "a")),
        lambda source: edits.append_item(source, ("x", "b"), 3),
        lambda source: edits.remove(source, ("x", "b", 0)),
        lambda source: edits.set_key(source, ("x",), "a", 3),
        lambda source: edits.replace_value(source, ("links", 0, "hosts", 0), "k"),
        lambda source: edits.exchange(source, ("x", "a"), ("x", "c"), 2, 3),
    ],
)
def test_no_edit_writes_over_a_variable(edit: Callable[[Any], edits.Edits]) -> None:
    text = (
        "vars: {v: 2, w: [1, 2], g: 'h*'}\nx: {a: '${v}', b: '${w}', c: 3}\n"
        "hosts: {h: {}}\nlinks: [{hosts: ['${g}']}]\n"
    )
    source = source_of_text(text, "a.yaml")
    assert source.data["x"] == {"a": 2, "b": (1, 2), "c": 3}
    assert source.data["links"][0]["hosts"] == ("h",)
    assert edit(source) == ()


def test_a_conversion_keeps_variables(tmp_path: Path) -> None:
    lab = document(
        tmp_path, PAIR.replace("leader: laptop", "leader: ${lead}") + "vars: {lead: laptop, v: 1}\n"
    )
    text = converted(lab, Mode.CENTRAL).text
    assert "\nmode: central\nhub: ${lead}\n" in text
    assert "v=${v}" in text


def test_a_stop_finds_its_hosts(tmp_path: Path) -> None:
    text = re.sub(r"192\.168\.77(\.\d+)", r"'${net}\1'", PAIR)
    found, _ = reach_of(written(tmp_path, text, "vars: {net: 10.0.5}\nmode: no-mode\n"))
    assert found is not None
    assert found.hosts["k3-pi"].address == "10.0.5.11"
