"""Whole labs as people keep them: what the draft says about each value."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.importing.drafting import DraftError
from tests.importing.drafts import LABS, draft, lab

SECRETS = ("raspberry", "hunter2", "correcthorse", "62313365", "s3cr3t-t0ken", "axisroot", "1972", "lab-pw")


@pytest.mark.parametrize("name", sorted(one.name for one in LABS.iterdir() if one.is_dir()))
def test_each_lab_has_its_draft(name: str, golden: Callable[[Path, str], None]) -> None:
    found = draft(LABS / name)
    golden(LABS / f"{name}.yaml", f"{found.text}# {found.summary}\n")


@pytest.mark.parametrize("name", sorted(one.name for one in LABS.iterdir() if one.is_dir()))
def test_no_secret_of_a_lab_is_in_its_draft(name: str) -> None:
    files = [one.read_text("utf-8") for one in (LABS / name).rglob("*") if one.is_file()]
    kept = [one for one in SECRETS if any(one in text for text in files)]
    assert [one for one in kept if one in draft(LABS / name).text] == []


def test_what_validate_refuses_is_to_fill_in(tmp_path: Path) -> None:
    inventory = "[epucks]\na ansible_host=10.0.0.1\nb ansible_host=10.0.0.1\n"
    found = draft(lab(tmp_path, {"inventory.ini": inventory}))
    assert "fill in: " in next(line for line in found.text.split("\n") if "b:" in line)


PIECES = [
    *("[a]", "[a:vars]", "[a:children]", "a", "b[1:3]", "x=y", "ansible_host=10.0.0.1", "{{ z }}", "#", ";"),
    *("export ", "ROS_IP=", "ROS_MASTER_URI=http://a:b", "$(x)", "<launch>", "</launch>", "</group>"),
    *("<machine name='m' address='n'/>", "<node pkg='p' type='koala' name='/'/>", "<group ns='$(arg q)'>"),
    *("all:", "  hosts:", "  - ", "system:", "platform: &p", "*p", "hosts: {a: *p}", "!vault", "'", '"'),
    *("\n", "\n", "\n  ", " ", "\t", "\u2028", "\x00", "\ufeff"),
]
FILES = ["x.launch", "hosts.ini", "hosts", "robot.yaml", "env.sh"]


@settings(max_examples=30)
@given(st.lists(st.sampled_from(PIECES), max_size=14), st.sampled_from(FILES))
def test_odd_files_are_drafted_or_refused(pieces: list[str], name: str) -> None:
    with tempfile.TemporaryDirectory() as folder, suppress(DraftError):
        draft(lab(Path(folder), {name: "".join(pieces)}))


@pytest.mark.parametrize(
    ("files", "shown"),
    [
        (
            {"a.urdf": "<robot/>", "b.xacro": "<robot/>", "src/c.cpp": "", "msg/D.msg": "", "e.bag": ""},
            "2 robot descriptions, 1 C or C++ source, 1 interface of ROS, 1 recording",
        ),
        ({"launch/helper.py": "x = 1\n"}, "1 Python file"),
        ({"config/nav.yaml": "n:\n  ros__parameters: {a: 1}\n"}, "1 parameter file of ROS 2"),
        ({"start.sh": "echo hello\n"}, "1 script"),
        ({}, "no file"),
    ],
)
def test_what_cannot_be_imported_is_named_by_its_kind(
    files: dict[str, str], shown: str, tmp_path: Path
) -> None:
    with pytest.raises(DraftError) as error:
        draft(lab(tmp_path, files))
    assert error.value.args[0].endswith(f"has nothing that can be imported: {shown}")


def test_a_file_that_nothing_uses_is_named(tmp_path: Path) -> None:
    nodes = '<launch><node pkg="p" exec="e" name="n"/></launch>'
    files = {"a.launch.xml": nodes, "config/a.yaml": "a: 1\n", "config/b.yaml": "b: 1\n", "c.sh": "echo\n"}
    made = draft(lab(tmp_path, files))
    assert "#   c.sh: script of which nothing is read\n" in made.text
    assert "#   config/a.yaml, config/b.yaml: YAML files of which nothing is read\n" in made.text
    assert "; 7 values: 3 kept, 2 to fill in, 2 not read; " in made.summary
