"""A spec with a file that cannot be read: what is certain is found, and nothing that the file may correct."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.diagnostics import Diagnostic
from swarmctl.rules.runner import lint_files
from swarmctl.rules.unread_parts import CERTAIN
from tests import ROOT
from tests.rules.specs import BROKEN, DOUBTFUL, specs_in

EXAMPLES = sorted((ROOT / "examples").glob("*/swarm.yaml"))
SECTIONS = ("hosts", "robots", "links", "programs", "control", "islands")
IN_FILES_BESIDE = {"SEC003"}  # test_security has the specs


def beside_a_lost_file(spec: Path, text: str) -> tuple[Diagnostic, ...]:
    """Returns what is found in a spec with this text, without the error about the file that it includes."""

    def read(path: Path) -> bytes:
        return f"{text}\ninclude: lost.yaml\n".encode() if path == spec else path.read_bytes()

    found = lint_files([spec], read).diagnostics
    assert Counter(one.code for one in found)["FILE001"] == 1
    return tuple(one for one in found if one.code != "FILE001")


def without_parts(data: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Yields a spec without each of its keys, and without the first entry of each of its sections."""
    for key, value in data.items():
        rest = {name: one for name, one in data.items() if name != key}
        yield rest
        if key in SECTIONS and len(value) > 1:
            entries = dict(list(value.items())[1:]) if isinstance(value, dict) else value[1:]
            yield {**rest, key: entries}


@pytest.mark.parametrize("spec", EXAMPLES, ids=lambda spec: spec.parent.name)
def test_what_a_lost_file_may_have_is_not_missed(spec: Path) -> None:
    """Each part of a valid spec may be in the file that is lost."""
    data = yaml.safe_load(spec.read_text("utf-8"))
    expected = lint_files([spec]).diagnostics
    known = {(one.code, one.message) for one in expected}
    for rest in without_parts(data):
        found = beside_a_lost_file(spec, yaml.safe_dump(rest, sort_keys=False))
        assert {(one.code, one.message) for one in found} <= known, sorted(rest)


@cache
def certain_and_found() -> tuple[frozenset[str], frozenset[str]]:
    """Of the specs that are named after a certain rule: the rules, and those found beside a lost file."""
    named: set[str] = set()
    shown: set[str] = set()
    for spec in (one for folder in (BROKEN, DOUBTFUL) for one in specs_in(folder)):
        code = spec.stem.partition("-")[0]
        if code in CERTAIN - shown:
            named.add(code)
            shown |= {one.code for one in beside_a_lost_file(spec, spec.read_text("utf-8"))} & {code}
    return frozenset(named), frozenset(shown)


def test_what_is_certain_is_found_beside_a_lost_file() -> None:
    named, shown = certain_and_found()
    assert named - shown == set()


def test_every_certain_rule_has_a_spec() -> None:
    named, _ = certain_and_found()
    assert CERTAIN - named - IN_FILES_BESIDE == set()


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("lost.yaml", None),
        ("lost.yaml", "hosts: {"),
        ("lost.yaml", "a: &a [*a, *a]\n  b"),
        ("../lost.yaml", "hosts: {}"),
        (".lost.yaml", "hosts: {}"),
        ("lost.txt", "hosts: {}"),
    ],
    ids=["missing", "brace", "syntax", "outside", "hidden", "suffix"],
)
def test_the_rest_is_checked_whatever_is_wrong_with_the_file(
    name: str, text: str | None, tmp_path: Path
) -> None:
    folder = tmp_path / "project"
    folder.mkdir()
    if text is not None:
        (folder / name).write_text(text, "utf-8")
    spec = (EXAMPLES[-1]).read_text("utf-8").replace("192.168.77.11", "192.168.77.10")
    (folder / "swarm.yaml").write_text(f"include: {name}\n{spec}", "utf-8")
    assert [one.code for one in lint_files([folder / "swarm.yaml"]).diagnostics][1:] == ["ID001"]


def test_the_spec_below_a_broken_overlay_is_checked(tmp_path: Path) -> None:
    spec, overlay = tmp_path / "swarm.yaml", tmp_path / "field.yaml"
    text = EXAMPLES[-1].read_text("utf-8").replace("192.168.77.11", "192.168.77.10")
    spec.write_text(text.replace("leader: koala-laptop", "leader: other"), "utf-8")
    overlay.write_text("hosts: {", "utf-8")
    assert sorted(one.code for one in lint_files([spec, overlay]).diagnostics) == ["ID001", "YAML001"]
    assert run(["validate", str(spec), "-f", str(overlay)]) == exit_codes.ERROR
