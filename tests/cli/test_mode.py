"""``swarmctl mode infer`` and ``mode convert``, as people type them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from swarmctl.cli import exits
from swarmctl.cli.app import run

MODES = Path(__file__).parents[1] / "topology" / "modes"


@pytest.fixture
def spec(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    place = tmp_path / "swarm.yaml"
    place.write_bytes((MODES / "leader.yaml").read_bytes())
    return Path("swarm.yaml")


def test_it_says_what_the_wiring_is_and_why(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["mode", "infer", str(spec)]) == exits.OK
    assert capsys.readouterr().out.splitlines() == [
        "this is mode leader",
        "  one master, on `koala-laptop`; `epuck-pi`, `k3-pi` work too",
        "  `koala-laptop` alone commands the robots of other hosts: `epuck`, `k3`",
    ]


def test_a_wiring_that_is_not_what_it_says(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = spec.read_text("utf-8").replace("mode: leader\nleader:", "mode: central\nhub:")
    spec.write_text(text, "utf-8")
    assert run(["mode", "infer", str(spec)]) == exits.ERROR
    out = capsys.readouterr().out
    assert out.startswith("this is mode leader; declared is central\n")
    assert "-  - {by: koala-laptop, of: [koala, k3, epuck]}\n" in out
    assert "+  - {by: k3-pi, of: [k3]}\n" in out
    assert run(["mode", "infer", str(spec), "--json"]) == exits.ERROR
    told = json.loads(capsys.readouterr().out)
    assert (told["mode"], told["declared"], told["hub"]) == ("leader", "central", "koala-laptop")


def test_the_edit_is_shown_and_nothing_written(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = spec.read_bytes()
    assert run(["mode", "convert", str(spec), "--to", "single-minded"]) == exits.OK
    printed = capsys.readouterr()
    assert "-mode: leader\n+mode: single-minded\n" in printed.out
    assert "by hand: plug the line of `k3` into `koala-laptop` instead of `k3-pi`" in printed.err
    assert spec.read_bytes() == before


@pytest.mark.parametrize("to", ["single-minded", "leader", "central", "standalone", "combined"])
def test_what_is_written_is_that_mode(spec: Path, to: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["mode", "convert", str(spec), "--to", to, "--write"]) == exits.OK
    capsys.readouterr()
    assert run(["mode", "infer", str(spec)]) == exits.OK
    assert capsys.readouterr().out.startswith(f"this is mode {to}\n")
    assert run(["validate", "-q", str(spec)]) == exits.OK


def test_a_mode_that_does_not_exist(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["mode", "convert", str(spec), "--to", "centrall"]) == exits.USAGE
    assert "did you mean `central`?" in capsys.readouterr().err


def test_a_spec_in_two_files_is_left_alone(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = spec.read_text("utf-8")
    control = text.index("\ncontrol:")
    Path("control.yaml").write_text(text[control:], "utf-8")
    spec.write_text(f"include: control.yaml\n{text[:control]}", "utf-8")
    assert run(["mode", "convert", str(spec), "--to", "central", "--write"]) == exits.ERROR
    assert "swarmctl spec --expanded" in capsys.readouterr().err
    assert "mode: leader" in spec.read_text("utf-8")
