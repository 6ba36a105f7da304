"""``swarmctl import``: the draft on stdout or in a file, and errors that say how to go on."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from tests import ROOT
from tests.importing.drafts import LABS, lab

PAGE = (ROOT / "docs/import.md").read_text("utf-8")
Captured = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_the_page_shows_what_is_printed(tmp_path: Path, capsys: Captured) -> None:
    (inventory,) = re.findall(r"^```ini\n(.+?)^```", PAGE, re.MULTILINE | re.DOTALL)
    (shown,) = re.findall(r"^it drafts\n\n```\n(.+?)^```", PAGE, re.MULTILINE | re.DOTALL)
    lab(tmp_path, {"inventory.ini": inventory})
    assert run(["import", "inventory.ini"]) == exit_codes.OK
    assert capsys.readouterr().out == shown


def test_the_draft_and_its_summary_are_apart(capsys: Captured) -> None:
    assert run(["import", str(LABS / "paper")]) == exit_codes.OK
    shown = capsys.readouterr()
    assert shown.out in (LABS / "paper.yaml").read_text("utf-8")
    assert shown.err.startswith("3 hosts, 4 robots, 2 programs; ")
    assert shown.err.endswith("swarmctl validate\n")


def test_a_file_is_overwritten_only_by_force(tmp_path: Path, capsys: Captured) -> None:
    target = lab(tmp_path, {"mine.yaml": "mine"}) / "mine.yaml"
    assert run(["import", str(LABS / "paper"), "-o", "mine.yaml"]) == exit_codes.ERROR
    assert "mine.yaml exists already" in capsys.readouterr().err
    assert target.read_text("utf-8") == "mine"
    assert run(["import", str(LABS / "paper"), "-o", "mine.yaml", "--force"]) == exit_codes.OK
    assert target.read_text("utf-8") in (LABS / "paper.yaml").read_text("utf-8")
    assert capsys.readouterr().err.endswith("swarmctl validate mine.yaml\n")


CLEARPATH = "serial_number: j100-0001\nsystem: {hosts: [{hostname: cpr, ip: 10.0.0.2}]}\n"
INVENTORY = "[pis]\nk3 ansible_host=10.0.0.1\n"


@pytest.mark.parametrize(
    ("files", "arguments", "problem"),
    [
        ({}, ["."], "`.` has nothing that can be imported"),
        ({}, ["absent"], "there is no file or folder `absent`"),
        ({"notes.txt": "x"}, ["."], "`.` has nothing that can be imported"),
        ({"hosts.yml": "all:\n  - x: y: z\n"}, ["."], "hosts.yml:2: it is not one valid document of YAML"),
        ({"a.ini": INVENTORY, "b/hosts": INVENTORY}, ["."], "swarmctl import a.ini"),
        ({"a.ini": INVENTORY, "r.yaml": CLEARPATH}, ["."], "swarmctl import . --from ansible"),
        ({"a.ini": INVENTORY}, [".", "--from", "launch"], "swarmctl import . --from ansible"),
        ({"x.launch": "<launch/>"}, ["."], "`.` names no host, robot or program that can be imported"),
        ({"x.launch": "<launch>"}, ["."], "x.launch:1: it is not well-formed XML"),
    ],
)
def test_what_cannot_be_imported_says_how_to_go_on(
    files: dict[str, str], arguments: list[str], problem: str, tmp_path: Path, capsys: Captured
) -> None:
    lab(tmp_path, files)
    assert run(["import", *arguments]) == exit_codes.ERROR
    shown = capsys.readouterr()
    assert problem in shown.err
    assert (shown.out, "help: " in shown.err) == ("", True)


def test_what_a_spec_lacks_is_shown_and_nothing_written(tmp_path: Path, capsys: Captured) -> None:
    lab(tmp_path, {"a.ini": f"{INVENTORY}# x\n"})
    spec = tmp_path / "swarm.yaml"
    shutil.copy(ROOT / "examples/paper-3-central/swarm.yaml", spec)
    before = spec.read_bytes()
    assert run(["import", "a.ini", "--onto", "swarm.yaml"]) == exit_codes.OK
    assert capsys.readouterr().out.startswith(
        "# What the Ansible inventory a.ini has and swarm.yaml has not."
    )
    assert spec.read_bytes() == before
    assert run(["import", "a.ini", "--onto", "swarm.yaml", "--out", "x.yaml"]) == exit_codes.USAGE
    assert "leave out --out" in capsys.readouterr().err


def test_an_unknown_kind_is_a_usage_error(capsys: Captured) -> None:
    assert run(["import", ".", "--from", "ansibel"]) == exit_codes.USAGE
    assert "did you mean `ansible`?" in capsys.readouterr().err


def test_one_kind_of_several_can_be_chosen(tmp_path: Path, capsys: Captured) -> None:
    lab(tmp_path, {"a.ini": INVENTORY, "x.launch": "<launch/>"})
    assert run(["import", ".", "--from", "ansible"]) == exit_codes.OK
    assert "from the Ansible inventory a.ini" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["hosts.ini", "group_vars/all.yml", "x.sh"])
def test_a_link_out_of_the_folder_is_not_read(name: str, tmp_path: Path, capsys: Captured) -> None:
    lab(tmp_path, {"out/secret": "ansible_user: leaked\nROS_IP=10.9.9.9\n", "in/inventory.ini": INVENTORY})
    (tmp_path / "in" / name).parent.mkdir(exist_ok=True)
    (tmp_path / "in" / name).symlink_to(tmp_path / "out/secret")
    assert run(["import", "in"]) == exit_codes.OK
    assert not re.search("leaked|10.9.9.9", capsys.readouterr().out)


def test_a_file_that_is_not_utf8_is_named_with_its_line(tmp_path: Path, capsys: Captured) -> None:
    (tmp_path / "x.launch").write_bytes(b"<launch>\n\xff</launch>")
    assert run(["import", "x.launch"]) == exit_codes.ERROR
    assert "error: x.launch:2:1: the byte 0xFF is not valid UTF-8" in capsys.readouterr().err
    (tmp_path / "hosts.ini").write_text(INVENTORY, "utf-8")
    assert run(["import", "."]) == exit_codes.OK
    assert "#   x.launch:2: the byte 0xFF is not valid UTF-8" in capsys.readouterr().out
