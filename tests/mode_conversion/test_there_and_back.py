"""Every example, also with ranges, into every mode and back: nothing is lost, or the conversion refuses."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from swarmctl.diagnostics import has_errors
from swarmctl.linter.runner import lint
from swarmctl.mode_conversion.convert import Conversion, converted
from swarmctl.mode_conversion.infer import ArrangementError
from swarmctl.render.build_bundle import bundles
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import Document, load_text
from swarmctl.spec.model import Mode
from swarmctl.swarm.resolve import resolve
from tests import ROOT

RANGES = """version: 1
name: fleet
mode: {mode}
{role}: laptop   # the desk
hosts:
  laptop: {{address: 10.0.0.1, computer: laptop}}
  "pi-[1-6]": {{address: "10.0.0.[2-7]"}}   # six of a kind
robots:
  "k3-[1-6]": {{type: khepera3, host: {host}}}
links:
  - {{kind: wlan, name: lab, hosts: [laptop, "pi-[1-6]"], subnet: 10.0.0.0/24, multicast: true}}
  - {{kind: serial, host: {host}, robot: "k3-[1-6]", usb: {{serial: "A[1-6]"}}}}   # six lines
control:
  - {{by: laptop, of: ["k3-[1-6]"], priority: 7}}
"""
TEXTS = {
    **{
        str(file.relative_to(ROOT / "examples")): file.read_text("utf-8")
        for file in sorted(ROOT.glob("examples/*/swarm.yaml"))
    },
    "ranges-leader": RANGES.format(mode="leader", role="leader", host='"pi-[1-6]"'),
    "ranges-central": RANGES.format(mode="central", role="hub", host='"pi-[1-6]"'),
    "ranges-single-minded": RANGES.format(mode="single-minded", role="leader", host="laptop"),
}


def read(text: str, path: Path) -> Document:
    document, found = load_text(text, str(path), load_catalog())
    assert document is not None, found
    return document


def bytes_of(document: Document) -> object:
    return bundles(resolve(document))


def conversion_of(document: Document, mode: Mode) -> Conversion | None:
    """The conversion; None if it refuses, as the verb does, and names what it would lose or cannot write."""
    try:
        made = converted(document, mode)
    except ArrangementError:
        return None
    if made.undone or has_errors(lint(read(made.text, Path(document.source.path)))):
        return None
    return made


@pytest.mark.parametrize("name", TEXTS)
@pytest.mark.parametrize("mode", list(Mode), ids=lambda mode: mode.value)
def test_nothing_is_lost_there_and_back(name: str, mode: Mode, tmp_path: Path) -> None:
    path = tmp_path / "swarm.yaml"
    text = TEXTS[name]
    if (folder := (ROOT / "examples" / name).parent).is_dir() and "/" in name:
        shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    document = read(text, path)
    there = conversion_of(document, mode)
    if there is None:
        return
    result = read(there.text, path)
    assert set(document.spec.control) <= set(result.spec.control)
    for line in text.splitlines():
        assert line.partition("#")[2] in there.text or line.startswith(("leader:", "hub:"))
    if "ranges" in name:
        assert there.text.count("[1-6]") >= text.count("[1-6]") - 2 * bool(there.by_hand)
    back = conversion_of(result, document.spec.mode)
    if back is not None and not there.by_hand and not there.notes:
        again = read(back.text, path)
        assert set(again.spec.control) == set(document.spec.control)
        if (again.spec.leader, again.spec.hub) == (document.spec.leader, document.spec.hub):
            assert bytes_of(again) == bytes_of(document)


def test_a_whole_range_moves_as_one() -> None:
    made = converted(read(TEXTS["ranges-leader"], Path("swarm.yaml")), Mode.SINGLE_MINDED)
    assert made.undone == ()
    assert '"k3-[1-6]": {type: khepera3, host: "laptop"}' in made.text
    assert 'host: "laptop", robot: "k3-[1-6]", usb: {serial: "A[1-6]"}}   # six lines' in made.text
    assert len(made.by_hand) == 6


def test_a_range_whose_elements_part_is_not_touched() -> None:
    made = converted(read(TEXTS["ranges-single-minded"], Path("swarm.yaml")), Mode.CENTRAL)
    assert any("host" in one for one in made.undone)
    assert 'host: laptop, robot: "k3-[1-6]"' in made.text
