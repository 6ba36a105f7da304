"""Which entries of a folder are bags, who recorded one, and what repairs one. Reads none."""

from __future__ import annotations

import re
from pathlib import Path

#: What stands behind the host in the name of a bag: when its recording began, and its number.
_RECORDING = re.compile(r"(_\d{4}(-\d\d){5})?(_\d+)?\.(bag|mcap)$", re.ASCII)


def bags_in(folder: Path) -> list[Path]:
    """Returns bags of ROS 1, MCAP files and folders of bags of ROS 2, by name. Raises ``OSError``."""
    return [
        one
        for one in sorted(folder.iterdir())
        if one.name.endswith((".bag", ".mcap", ".active")) or (one / "metadata.yaml").is_file()
    ]


def recorder(bag: Path) -> str:
    """Returns the host of a bag, by the name that ``swarmctl record`` gives it."""
    found = _RECORDING.search(bag.name)
    return bag.name[: found.start()] if found else bag.name


def repair(bag: Path) -> str:
    """Returns the command that repairs a bag whose name ends with ``.active``, as it was not closed."""
    return (
        f"mcap recover {bag} -o {bag.with_suffix('')}" if ".mcap" in bag.suffixes else f"rosbag reindex {bag}"
    )
