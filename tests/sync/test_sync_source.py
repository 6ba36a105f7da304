"""The static multimaster is what robots can run: Python 3.8, standard library, PyYAML, no ROS library."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import pytest

TEMPLATES = Path(__file__).parents[2] / "templates"
FILES = sorted(path for folder in ("sync", "shared") for path in (TEMPLATES / folder).rglob("*.py"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(TEMPLATES)))
def test_every_file_is_python_3_8_and_imports_what_a_robot_has(path: Path) -> None:
    tree = ast.parse(path.read_text(), feature_version=(3, 8))
    imported = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    imported |= {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    known = sys.stdlib_module_names - {"tomllib", "zoneinfo", "graphlib"} | {
        "yaml",
        "swarm_sync",
        "swarm_shared",
    }
    assert {name.split(".")[0] for name in imported} <= known
