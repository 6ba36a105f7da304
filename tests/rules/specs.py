"""The specs of `broken` (refused) and `doubtful` (accepted with a warning), by what is wrong with them."""

from __future__ import annotations

from pathlib import Path

from tests import ROOT

BROKEN = ROOT / "tests/rules/broken"
DOUBTFUL = ROOT / "tests/rules/doubtful"


def specs_in(folder: Path) -> list[Path]:
    """Every spec of one of the two folders: ``<family>/<RULE>-<what>.yaml``."""
    return sorted(folder.glob("*/*.yaml"))


def spec(folder: Path, what: str) -> Path:
    """The one spec of a folder that shows ``what``."""
    (found,) = (path for path in specs_in(folder) if path.stem.partition("-")[2] == what)
    return found
