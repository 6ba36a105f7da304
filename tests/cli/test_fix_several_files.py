"""``validate --fix`` where a spec has several files: a fault is corrected in its file, all or none."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from tests.robot_types.test_hostile_types import LINE

SPEC = """\
include: parts/hosts.yaml
version: 1
name: lab
mode: leader
leader: laptop
robots:
  koala: {type: koala, host: laptop}
  snail: {type: snail, host: laptop}
links:
  - {kind: serial, host: laptop, robot: koala, usb: {serial: A600dXyz}}  # the old one
  - {kind: serial, host: laptop, robot: snail, usb: {serial: FTDI1234}}
"""
FILES = {
    "swarm.yaml": SPEC,
    "parts/hosts.yaml": "hosts:\n  laptop: {address: 192.168.77.10}  # on the desk\n",
    "field.yaml": "hosts:\n  laptop: {address: 10.0.0.2}\ncontrol:\n  - {by: laptop, of: [koala, snail]}\n",
    "robots/snail.yaml": LINE,
}
FIX = ["validate", "--fix", "swarm.yaml", "-f", "field.yaml"]


@pytest.fixture(autouse=True)
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A valid spec with an included file, an overlay and a robot type."""
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.delenv("GITHUB_ACTIONS", raising=False)
    folder = tmp_path / "project"
    for name, text in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, "utf-8")
    monkeypatch.chdir(folder)
    return folder


def texts() -> Mapping[str, str]:
    """Every file of the project, by name."""
    return {str(one): one.read_text("utf-8") for one in Path().rglob("*") if one.is_file()}


def break_(name: str, right: str, wrong: str) -> None:
    assert right in FILES[name]
    Path(name).write_text(Path(name).read_text("utf-8").replace(right, wrong), "utf-8")


def break_name_everywhere() -> None:
    for name, text in FILES.items():
        Path(name).write_text(text.replace("laptop", "Laptop"), "utf-8")


def counts(capsys: pytest.CaptureFixture[str]) -> tuple[int, int]:
    """How many errors there are, and how many of them are counted as fixable."""
    capsys.readouterr()
    run(["validate", "swarm.yaml", "-f", "field.yaml", "--format", "json"])
    report = json.loads(capsys.readouterr().out)
    errors = sum(one["severity"] == "error" for one in report["diagnostics"])
    return errors, report["specs"][0]["fixable"]


@pytest.mark.parametrize(
    ("name", "right", "wrong"),
    [
        ("swarm.yaml", "mode: leader", "mode: leadr"),
        ("parts/hosts.yaml", "address", "adress"),
        ("field.yaml", "address", "adress"),
        ("field.yaml", "control", "controll"),
        ("robots/snail.yaml", "wheel_separation", "wheel_seperation"),
        ("robots/snail.yaml", "baud: 115200", 'baud: "115200"'),
    ],
)
def test_the_file_with_the_fault_is_corrected(name: str, right: str, wrong: str) -> None:
    break_(name, right, wrong)
    assert run(FIX) == exit_codes.OK
    assert texts() == FILES


def test_faults_of_all_files_are_counted_and_corrected(capsys: pytest.CaptureFixture[str]) -> None:
    break_("swarm.yaml", "A600dXyz}}", "A600dXyz}, baudd: 115200}")
    break_("parts/hosts.yaml", "address", "adress")
    break_("field.yaml", "control", "controll")
    break_("robots/snail.yaml", "wheel_separation", "wheel_seperation")
    errors, fixable = counts(capsys)
    assert errors == fixable == 4
    assert run(FIX) == exit_codes.OK
    fixed = re.findall(r"^fixed \S+ ([^:]+):", capsys.readouterr().err, re.MULTILINE)
    assert sorted(fixed) == sorted(FILES)
    assert counts(capsys) == (0, 0)


def test_what_is_counted_is_corrected_beside_what_is_not(capsys: pytest.CaptureFixture[str]) -> None:
    """The same words are wrong in two files; one of them is in a list that has them twice."""
    break_("swarm.yaml", "A600dXyz}}", "A600dXyz}, baudd: 115200, baud: 115200}")
    break_("field.yaml", "control:", "links:\n  - {robot: snail, baudd: 57600}\ncontrol:")
    errors, fixable = counts(capsys)
    run(FIX)
    assert counts(capsys)[0] == errors - fixable


def test_a_name_is_changed_in_all_files() -> None:
    break_name_everywhere()
    assert run(FIX) == exit_codes.OK
    assert texts() == FILES


def test_a_name_is_changed_where_another_file_replaces_it() -> None:
    """The spec below an overlay stays right by itself."""
    break_name_everywhere()
    overlay = "leader: k3-pi\nhosts: {k3-pi: {address: 10.0.0.3}}\nrobots: {koala: {host: k3-pi}}\n"
    Path("field.yaml").write_text(overlay + "links: [{robot: koala, host: k3-pi}]\n", "utf-8")
    run(FIX)
    assert Path("swarm.yaml").read_text("utf-8") == SPEC
    assert run(["validate", "--quiet", "swarm.yaml"]) == exit_codes.OK


@pytest.mark.parametrize("name", ["swarm.yaml", "parts/hosts.yaml", "field.yaml"])
def test_no_file_is_changed_if_one_is_read_only(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    break_name_everywhere()
    before, locked = texts(), Path(name).resolve()
    monkeypatch.setattr(os, "access", lambda path, _: Path(path) != locked)  # root may write any file
    assert run(FIX) == exit_codes.ERROR
    assert f"{name} was not written: it is read-only; no file was changed" in capsys.readouterr().err
    assert texts() == before


@pytest.mark.parametrize("refused", [1, 2, 3])
@pytest.mark.parametrize("step", ["fsync", "replace"])
def test_no_file_is_changed_if_one_cannot_be_written(
    step: str, refused: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    break_name_everywhere()
    before, calls = texts(), []
    holder = os if step == "fsync" else Path
    real = getattr(holder, step)

    def full(*arguments: object) -> object:
        calls.append(arguments)
        if len(calls) == refused:
            raise OSError(28, "No space left on device")
        return real(*arguments)

    monkeypatch.setattr(holder, step, full)
    assert run(FIX) == exit_codes.ERROR
    assert "No space left on device; no file was changed" in capsys.readouterr().err
    assert texts() == before


@pytest.mark.parametrize("how", ["include", "link", "type"])
def test_a_file_outside_of_the_project_is_not_changed(
    how: str, project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    outside = project.parent / "outside.yaml"
    outside.write_text(LINE.replace("wheel_separation", "wheel_seperation"), "utf-8")
    if how == "include":
        break_("swarm.yaml", "parts/hosts.yaml", "[parts/hosts.yaml, ../outside.yaml]")
    else:
        name = Path("parts/hosts.yaml" if how == "link" else "robots/snail.yaml")
        name.unlink()
        name.symlink_to(outside)
    break_("field.yaml", "control", "controll")
    before = outside.read_text("utf-8")
    assert run(FIX) == exit_codes.ERROR
    message = (
        "lies outside the spec's folder" if how != "type" else "is a link to what is no part of the spec"
    )
    assert message in capsys.readouterr().err
    assert outside.read_text("utf-8") == before
    assert Path("field.yaml").read_text("utf-8") == FILES["field.yaml"]  # what can be corrected is
