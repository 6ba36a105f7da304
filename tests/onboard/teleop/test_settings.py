"""The settings are one file; what validate takes the programs take, and nothing else."""

from __future__ import annotations

import ast
import os
import re

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.teleop.config import SETTINGS, takes
from swarm_onboard.teleop.keyboard import CHANGES, MOVES

from swarmctl.resources import onboard
from swarmctl.spec.catalog import shipped
from swarmctl.swarm.shipped_programs import SHIPPED
from tests.loading import load_checked

KNOWN = yaml.safe_load(SETTINGS.read_text("utf-8"))
ALL = [(program, name) for program, settings in KNOWN.items() for name in settings]
FOLDER, SCRIPTS = onboard() / "teleop", onboard() / "nodes/teleop"
VALUES = st.one_of(
    st.booleans(),
    st.integers(-100, 200),
    st.floats(),
    st.text(max_size=8),
    st.sampled_from(["joy", "/dev/js0"]),
)


@given(st.sampled_from(ALL), VALUES)
def test_validate_and_the_program_agree_on_every_value(setting, value):
    program, name = setting
    assert shipped()[program][name].takes(value) == takes(KNOWN[program][name], value)


@pytest.mark.parametrize(("program", "name"), [one for one in ALL if "min" in KNOWN[one[0]][one[1]]])
def test_they_agree_on_the_bounds(program, name):
    setting = shipped()[program][name]
    for value, fits in {
        setting.min: True,
        setting.max: True,
        setting.min - 1: False,
        setting.max + 1: False,
    }.items():
        assert setting.takes(value) == takes(KNOWN[program][name], value) == fits


@pytest.mark.parametrize(("program", "name"), ALL)
def test_a_default_is_in_its_own_bounds(program, name):
    setting = shipped()[program][name]
    assert setting.takes(setting.default)
    assert not isinstance(setting.default, str) or setting.takes(setting.example)
    assert isinstance(setting.default, str) or setting.max < 1000


def test_every_shipped_program_has_settings():
    assert set(shipped()) == set(SHIPPED)


def test_no_button_may_be_none_where_it_is_the_dead_mans():
    assert shipped()["teleop-joy"]["deadman_button"].min == 0


@pytest.mark.parametrize("file", [*FOLDER.glob("*.py"), *SCRIPTS.glob("*.py")], ids=lambda file: file.name)
def test_teleop_is_written_for_the_python_of_ros_noetic(file):
    ast.parse(file.read_text(), feature_version=(3, 8))
    assert os.access(file, os.X_OK) == (file.parent == SCRIPTS)


def test_the_page_has_every_key_and_what_it_shows_passes(root, tmp_path):
    page = (root / "docs/teleop.md").read_text("utf-8")
    assert [key for key in (*MOVES, *CHANGES) if len(key) == 1 and f"`{key}`" not in page] == []
    blocks = re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)
    assert len(blocks) == 2
    swarm, _, _ = (root / "examples/paper-leader/swarm.yaml").read_text("utf-8").partition("\ncontrol:")
    for number, block in enumerate(blocks):
        overlay = tmp_path / f"{number}.yaml"
        overlay.write_text(block)
        (tmp_path / "swarm.yaml").write_text(swarm)
        document, found = load_checked(tmp_path / "swarm.yaml", overlay)
        assert document is not None, found
        assert [one for one in found if one.code.startswith("PROG") and number == 0] == []
