"""The exact message of every broken spec: its place and its fix."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.yamltext.files import MAX_BYTES
from tests.loading import lint_files
from tests.rules.specs import BROKEN, specs_in
from tests.rules.specs import spec as spec_of
from tests.timing import work_at_most

SPECS = specs_in(BROKEN)
PLACE = re.compile(r"^\w+\[\w+\]: .*\n +--> (.+):(\d+):(\d+)$", re.MULTILINE)  # of each finding


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    monkeypatch.setenv("NO_COLOR", "1")


def errors_of(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The standard error of ``swarmctl validate`` for a refused spec."""
    assert run(["validate", *arguments]) == exit_codes.ERROR
    printed = capsys.readouterr()
    assert printed.out == ""
    assert "bug in swarmctl" not in printed.err
    return printed.err


@pytest.mark.parametrize("spec", SPECS, ids=lambda spec: spec.stem)
def test_messages_in_the_order_of_the_text(
    spec: Path,
    golden: Callable[[Path, str], None],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(spec.parent)
    errors = errors_of(capsys, spec.name)
    golden(spec.with_suffix(".txt"), errors)
    places = [(file, int(line), int(column)) for file, line, column in PLACE.findall(errors)]
    assert places == sorted(places)


def test_independent_faults_show_at_once(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = spec_of(BROKEN, "nine-independent-faults")
    monkeypatch.chdir(spec.parent)
    errors = errors_of(capsys, spec.name)
    assert set(re.findall(r"# (\d): ", errors)) == set("12345789")
    assert "host `map-server` cannot reach its hub" in errors  # the sixth


@pytest.mark.parametrize(
    ("entries", "references"),
    [
        (lambda: "".join(f"  r{one}: {{type: zz{one}, host: hh{one}}}\n" for one in range(10_000)), 700),
        (lambda: "".join(f"  r{one}: {{tpe: koala, hst: laptop}}\n" for one in range(10_000)), 400),
        (lambda: "".join(f"  r{one}: {{type: koala, zz: 1}}\n" for one in range(190)), 150),
    ],
    ids=["names", "keys", "unknown keys"],
)
def test_many_errors_cost_little(entries: Callable[[], str], references: int) -> None:
    text = (
        "version: 1\nname: lab\nmode: leader\nleader: laptop\n"
        "hosts:\n  laptop: {address: 10.0.0.1}\n" + "robots:\n" + entries()
    )
    path = Path("swarm.yaml")
    with work_at_most(references):
        assert lint_files([path], lambda _: text.encode()).diagnostics


GAMEPAD = """
programs:
  stick: {host: koala-laptop, use: teleop-joy}
  pad:
    host: koala-laptop
    package: joy
    executable: joy_node
    params: {autorepeat_rate: {}}
    publishes: [{topic: joy, type: sensor_msgs/Joy}]
"""


@pytest.mark.parametrize(("more", "code"), [("types: 5\n", "SPEC003"), (GAMEPAD, "PROG024")])
def test_a_value_of_another_kind_is_a_finding(leader_spec: Path, more: str, code: str) -> None:
    text = leader_spec.read_text("utf-8").replace("-pi-2b", "-pi-2c", code == "SPEC003") + more
    found = lint_files([leader_spec], lambda _: text.encode()).diagnostics
    assert code in {one.code for one in found}


def test_no_message_is_left_over() -> None:
    assert {file.stem for file in BROKEN.glob("*/*.txt")} == {spec.stem for spec in SPECS}


def test_a_file_that_is_not_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "swarm.yaml").write_text("version: 1\n")
    monkeypatch.chdir(tmp_path)
    assert errors_of(capsys, "swam.yaml") == (
        "error[FILE001]: there is no file `swam.yaml`\n"
        " = help: did you mean `swarm.yaml`?\n\n"
        "1 error in swam.yaml\n"
    )


def test_a_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "lab").mkdir()
    for name in ("swarm.yaml", "hosts.yaml"):
        (tmp_path / "lab" / name).write_text("version: 1\n")
    monkeypatch.chdir(tmp_path)
    assert errors_of(capsys, "lab") == (
        "error[FILE001]: `lab` is a folder, not a spec\n"
        " = help: did you mean `lab/swarm.yaml`?\n\n"
        "1 error in lab\n"
    )


def test_a_file_too_large(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with (tmp_path / "disk.img").open("wb") as file:
        file.truncate(MAX_BYTES + 1)
    monkeypatch.chdir(tmp_path)
    assert errors_of(capsys, "disk.img") == (
        "error[FILE002]: `disk.img` is larger than 4 MiB, the limit for a spec\n\n1 error in disk.img\n"
    )


@pytest.mark.parametrize("device", ["/dev/zero", "/dev/null", "/dev/tty"])
def test_a_device_is_refused(device: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert "it is a device or a pipe, not a file" in errors_of(capsys, device)


def test_an_account_without_the_right_to_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    (tmp_path / "swarm.yaml").write_text("version: 1\n")
    monkeypatch.setattr(os, "open", refuse)
    monkeypatch.chdir(tmp_path)
    assert "error[FILE001]: cannot read `swarm.yaml`: Permission denied" in errors_of(capsys, "swarm.yaml")


def test_fifty_findings_are_shown_and_the_others_counted(
    tmp_path: Path, leader_spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = tmp_path / "swarm.yaml"
    more = "".join(f"  robot-{number}: {{type: koala, host: nowhere}}\n" for number in range(60))
    spec.write_text(leader_spec.read_text("utf-8").replace("robots:\n", f"robots:\n{more}"), "utf-8")
    text = errors_of(capsys, str(spec))
    assert text.count("error[") == 50
    assert text.endswith(f"... and 70 more\n120 errors in {spec}\n")  # unknown hosts, and no links
