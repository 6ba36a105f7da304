"""``swarmctl mode infer`` and ``mode convert``, as people type them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from tests import ROOT

MODES = ROOT / "tests/mode_conversion/modes"


@pytest.fixture
def spec(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    place = tmp_path / "swarm.yaml"
    place.write_bytes((MODES / "leader.yaml").read_bytes())
    return Path("swarm.yaml")


def test_it_says_what_the_wiring_is_and_why(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["mode", "infer", str(spec)]) == exit_codes.OK
    assert capsys.readouterr().out.splitlines() == [
        "the mode is leader",
        "  one master, on `koala-laptop`; robots or programs are also on `epuck-pi`, `k3-pi`",
        "  `koala-laptop` alone commands the robots of other hosts: `epuck`, `k3`",
    ]


def test_a_wiring_that_is_not_what_it_says(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = spec.read_text("utf-8").replace("mode: leader\nleader:", "mode: central\nhub:")
    spec.write_text(text, "utf-8")
    assert run(["mode", "infer", str(spec)]) == exit_codes.ERROR
    out = capsys.readouterr().out
    assert out.startswith("the mode is leader, but central is declared\n")
    assert "-  - {by: koala-laptop, of: [koala, k3, epuck]}\n" in out
    assert "+  - {by: k3-pi, of: [k3]}\n" in out
    assert run(["mode", "infer", str(spec), "--json"]) == exit_codes.ERROR
    report = json.loads(capsys.readouterr().out)
    assert (report["mode"], report["declared"], report["hub"]) == ("leader", "central", "koala-laptop")


def test_the_edit_is_shown_and_nothing_written(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = spec.read_bytes()
    assert run(["mode", "convert", str(spec), "--to", "single-minded"]) == exit_codes.OK
    printed = capsys.readouterr()
    assert "-mode: leader\n+mode: single-minded\n" in printed.out
    assert "by hand: plug the line of `k3` into `koala-laptop` instead of `k3-pi`" in printed.err
    assert spec.read_bytes() == before


@pytest.mark.parametrize("to", ["single-minded", "leader", "central", "standalone", "combined"])
def test_what_is_written_is_that_mode(spec: Path, to: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["mode", "convert", str(spec), "--to", to, "--write"]) == exit_codes.OK
    capsys.readouterr()
    assert run(["mode", "infer", str(spec)]) == exit_codes.OK
    assert capsys.readouterr().out.startswith(f"the mode is {to}\n")
    assert run(["validate", "-q", str(spec)]) == exit_codes.OK


def test_a_mode_that_does_not_exist(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["mode", "convert", str(spec), "--to", "centrall"]) == exit_codes.USAGE
    assert "did you mean `central`?" in capsys.readouterr().err


def test_a_spec_in_two_files_is_left_alone(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = spec.read_text("utf-8")
    control = text.index("\ncontrol:")
    Path("control.yaml").write_text(text[control:], "utf-8")
    spec.write_text(f"include: control.yaml\n{text[:control]}", "utf-8")
    assert run(["mode", "convert", str(spec), "--to", "central", "--write"]) == exit_codes.ERROR
    assert "swarmctl spec --expanded" in capsys.readouterr().err
    assert "mode: leader" in spec.read_text("utf-8")
