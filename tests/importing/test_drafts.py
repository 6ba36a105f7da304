"""Whole labs as people keep them: what the draft says about each value."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.importing.drafts import LABS, draft, lab

SECRETS = ("raspberry", "hunter2", "correcthorse", "62313365", "s3cr3t-t0ken", "axisroot", "1972", "lab-pw")


@pytest.mark.parametrize("name", sorted(one.name for one in LABS.iterdir() if one.is_dir()))
def test_each_lab_has_its_draft(name: str, golden: Callable[[Path, str], None]) -> None:
    found = draft(LABS / name)
    golden(LABS / f"{name}.yaml", f"{found.text}# {found.counts}\n")


@pytest.mark.parametrize("name", sorted(one.name for one in LABS.iterdir() if one.is_dir()))
def test_no_secret_of_a_lab_is_in_its_draft(name: str) -> None:
    files = [one.read_text("utf-8") for one in (LABS / name).rglob("*") if one.is_file()]
    kept = [one for one in SECRETS if any(one in text for text in files)]
    assert [one for one in kept if one in draft(LABS / name).text] == []


def test_what_validate_refuses_is_to_fill_in(tmp_path: Path) -> None:
    inventory = "[epucks]\na ansible_host=10.0.0.1\nb ansible_host=10.0.0.1\n"
    found = draft(lab(tmp_path, {"inventory.ini": inventory}))
    assert "fill in: " in next(line for line in found.text.split("\n") if "b:" in line)
