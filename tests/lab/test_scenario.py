"""Scenario files: what they say, their errors with file and line, and the words of their faults."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.lab.faults import kinds
from swarmctl.lab.scenario import read_scenario, scenario_of
from tests import ROOT

FAULT = '- {name: a, fault: unplug k3, first: "device k3: "}\n'


def entry(**changes: str | None) -> str:
    keys: dict[str, str | None] = {
        "name": "a", "host": "pi", "run": "rm x", "undo": "touch x", "first": '"files: "',
    }  # fmt: skip
    given = {key: value for key, value in (keys | changes).items() if value is not None}
    return "faults:\n- " + "\n  ".join(f"{key}: {value}" for key, value in given.items()) + "\n"


def test_a_file_is_read() -> None:
    entries, found = scenario_of("faults:\n" + FAULT + entry(within="15").removeprefix("faults:\n"), "f.yaml")
    assert not found
    assert [(one.fault, one.run, one.undo, one.within) for one in entries] == [
        ("unplug k3", None, None, 10.0),
        (None, "rm x", "touch x", 15.0),
    ]


@pytest.mark.parametrize("file", ["faults.yaml", "faults-of-islands.yaml", "faults-of-ros2.yaml"])
def test_the_files_of_make_faults_are_valid(file: str) -> None:
    entries, found = read_scenario(ROOT / "tests" / file)
    assert not found
    assert len({one.name for one in entries}) == len(entries)


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        (entry(run=None), "f.yaml:2", "an entry has either `fault` or `run`"),
        (entry(fault="unplug k3"), "f.yaml:2", "an entry has either `fault` or `run`"),
        (entry(run=None, fault="unplug k3"), "f.yaml:2", "`lab repair` ends a `fault`"),
        (entry(host=None), "f.yaml:2", "`run` needs `host`"),
        (entry(undo=None), "f.yaml:2", "either `undo` or `swarmctl`"),
        (entry(swarmctl="deploy"), "f.yaml:2", "either `undo` or `swarmctl`"),
        (entry(within="0"), "f.yaml:7", "within"),
        (entry(wihtin="9"), "f.yaml:7", "`wihtin`"),
        ("faults:\n" + FAULT.replace("unplug", "unplugg"), "f.yaml:2", "did you mean `unplug`?"),
        ("faults:\n" + FAULT.replace("unplug k3", "loss pi"), "f.yaml:2", "`loss` needs --percent N"),
        ("faults: []\n", "f.yaml:1", "faults"),
    ],
)
def test_errors_name_the_line(text: str, place: str, message: str) -> None:
    entries, found = scenario_of(text, "f.yaml")
    assert not entries
    places = [f"{one.span.file}:{one.span.line}" if one.span else "" for one in found]
    texts = [f"{one.message}; {one.help}" for one in found]
    assert any(where == place and message in text for where, text in zip(places, texts, strict=True)), texts


def test_a_file_that_is_not_there() -> None:
    assert "cannot read none.yaml" in read_scenario(Path("none.yaml"))[1][0].message


def test_the_words_of_a_fault() -> None:
    words = kinds.read("loss 'pi-*' k3-pi --percent=2.5")
    assert (words.kind.name, words.selections, words.value) == ("loss", ("pi-*", "k3-pi"), 2.5)
    assert kinds.read("clock pi --step -5").value == -5.0
    assert kinds.read("link-down pi").value is None


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("", "there is no fault ``"),
        ("unplug", "`unplug` needs a robot"),
        ("reboot", "`reboot` needs a host"),
        ("unplug k3 --percent 5", "`unplug` has no option --percent"),
        ("loss pi --percent", "--percent ``: write a number"),
        ("loss pi 'x", "No closing quotation"),
    ],
)
def test_wrong_words_of_a_fault(line: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        kinds.read(line)
