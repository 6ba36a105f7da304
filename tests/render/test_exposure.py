"""What systemd says of the units, as the golden files have them: each is shut in, and limited."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path

import pytest

EXPOSED_AT_MOST = 2.0
GOLDEN = Path(__file__).parent / "golden"
UNITS: Mapping[str, str] = {
    str(path.relative_to(GOLDEN)).replace("/", "."): path.read_text("utf-8")
    for path in sorted(GOLDEN.rglob("*.service"))
}


def engines_or_roots(text: str) -> bool:
    """True for a container, which its engine confines, and for a program of a host whose account is root."""
    return "the engine confines" in text or {"User=root", "DynamicUser=yes"} & set(text.splitlines()) == {
        "User=root"
    }


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="needs systemd-analyze")
def test_units_expose_little(tmp_path: Path) -> None:
    for name, text in UNITS.items():
        if not engines_or_roots(text):
            (tmp_path / name).write_text(text, "utf-8")
    found = subprocess.run(
        ["systemd-analyze", "security", "--offline=true", "--no-pager", *map(str, tmp_path.iterdir())],
        capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    exposures = {name: float(value) for name, value in re.findall(r"for (\S+): ([0-9.]+) ", found)}
    assert len(exposures) == len(list(tmp_path.iterdir()))
    assert {name: value for name, value in exposures.items() if value > EXPOSED_AT_MOST} == {}


def test_units_are_limited_in_memory_and_tasks() -> None:
    for name, text in UNITS.items():
        keys = {line.partition("=")[0] for line in text.splitlines()}
        assert "TasksMax" in keys, name
        assert "MemoryMax" in keys or "/usr/bin/env docker" in text, name
