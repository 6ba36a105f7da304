"""The agent is what robots can run: Python 3.8, only the standard library, a loader for any login shell."""

from __future__ import annotations

import ast
import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SOURCES = Path(__file__).parents[2] / "templates" / "agent"
FILES = sorted(SOURCES.rglob("*.py"))
MODERN_ONLY = {"tomllib", "zoneinfo", "graphlib"}


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(SOURCES)))
def test_every_file_is_python_3_8(path: Path) -> None:
    ast.parse(path.read_text(), feature_version=(3, 8))


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(SOURCES)))
def test_every_import_is_standard_library_or_the_agent_itself(path: Path) -> None:
    tree = ast.parse(path.read_text())
    # What a function imports is what a host may lack, ROS above all; the function deals with that.
    names = [
        name
        for node in tree.body
        for name in (
            [alias.name for alias in node.names]
            if isinstance(node, ast.Import)
            else [node.module or ""]
            if isinstance(node, ast.ImportFrom) and node.level == 0
            else []
        )
    ]
    allowed = (set(sys.stdlib_module_names) - MODERN_ONLY) | {"swarm_agent"}
    assert {name.split(".")[0] for name in names} <= allowed


@pytest.mark.skipif(shutil.which("python3.8") is None, reason="no python3.8 here")
def test_python_3_8_itself_imports_it() -> None:
    modules = [
        ".".join(path.relative_to(SOURCES).with_suffix("").parts)
        for path in FILES
        if path.name not in ("loader.py", "__init__.py")
    ]
    code = f"import sys, importlib; sys.path.insert(0, {str(SOURCES)!r}); "
    code += f"[importlib.import_module(name) for name in {modules!r}]"
    probe = subprocess.run(["python3.8", "--version"], capture_output=True, check=False)
    if probe.returncode:
        pytest.skip("no python3.8 here")
    subprocess.run(["python3.8", "-I", "-S", "-B", "-c", code], check=True, timeout=30)


def test_the_loader_means_the_same_to_every_login_shell() -> None:
    lines = (SOURCES / "loader.py").read_text().splitlines(keepends=True)
    source = "".join(line for line in lines if not line.startswith("#"))
    assert not set("'\\!") & set(source)
    assert json.dumps(source).isascii()
