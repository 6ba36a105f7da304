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
