"""The reference pages say what the models say."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.schema.markdown import reference


@pytest.mark.parametrize("name", ["swarm", "robot-type"])
def test_the_page_is_up_to_date(root: Path, name: str) -> None:
    assert (root / f"docs/{name}-reference.md").read_text("utf-8") == reference(name), "run `make generated`"


@pytest.mark.parametrize("name", ["swarm", "robot-type"])
def test_every_key_has_a_meaning(name: str) -> None:
    rows = [line for line in reference(name).splitlines() if line.startswith("| `")]
    assert rows
    assert [row for row in rows if row.endswith("|  |")] == []
