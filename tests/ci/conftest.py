"""A project that uses swarmctl, and what its CI runs it with."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import pytest

from tests.rules.specs import BROKEN, spec

OUTSIDE = ("PYTHONPATH", "VIRTUAL_ENV", "FORCE_COLOR")  # of this test run; CI has none of them


@pytest.fixture
def environment() -> dict[str, str]:
    """The variables that a job starts with; its PATH holds this environment's programs.

    pip compiles nothing that it installs: most of that is never imported.
    """
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    ours = {"PATH": path, "PIP_NO_COMPILE": "1"}
    return {key: value for key, value in os.environ.items() if key not in OUTSIDE} | ours


@pytest.fixture
def project(tmp_path: Path, leader_spec: Path) -> Path:
    """A folder with a right spec, another one in a folder, and none that is wrong."""
    folder = tmp_path / "project"
    (folder / "hall").mkdir(parents=True)
    shutil.copy(leader_spec, folder / "swarm.yaml")
    shutil.copy(leader_spec, folder / "hall/big.swarm.yaml")
    return folder


@pytest.fixture
def broken(root: Path) -> str:
    """The text of a spec with one error: SPEC003 in line 3."""
    return spec(BROKEN, "bad-mode").read_text("utf-8")
