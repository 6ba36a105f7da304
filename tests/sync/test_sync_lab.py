"""The static multimaster with real rosmasters and real rospy nodes, a network namespace for each island."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from swarmctl.lab import image, processes
from swarmctl.lab.errors import LabError

HERE = Path(__file__).parent
SEED = 20151113
EVENTS = 1000


@pytest.fixture(scope="module")
def disk() -> Path:
    """The lab's image, if this machine can have one."""
    try:
        processes.require("unshare", "ip", "mount", "mmdebstrap")
    except LabError as error:
        pytest.skip(f"no lab here: {error}")
    return image.ensured(lambda _told: None)


def run(script: str, *arguments: object) -> dict[str, Any]:
    """The figures that ``script`` prints; it runs in namespaces that end with it."""
    argv = (sys.executable, str(HERE / script), *map(str, arguments))
    done = subprocess.run(
        ("unshare", "--net", *processes.sealed(argv)),
        env=processes.environment(), capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-4000:]
    figures: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    print(json.dumps(figures))
    return figures


@pytest.mark.lab
def test_after_a_thousand_events_both_sides_of_every_bridge_are_as_declared(disk: Path) -> None:
    figures = run("storm.py", disk, SEED, EVENTS)
    assert figures["stale"] == ""
    assert figures["leaks"] == []
    assert figures["shut_down"] == []
    assert figures["races_for_a_name"] <= 3
    assert (figures["events"], figures["topics"]) == (EVENTS, 30)


@pytest.mark.lab
def test_a_rospy_listener_hears_a_talker_of_another_island_again_after_every_fault(disk: Path) -> None:
    figures = run("conversation.py", disk)
    assert figures.pop("quiet while cut") is True
    assert figures.pop("left behind") == []
    assert figures.pop("sync stopped") < 3.0
    assert {what: seconds for what, seconds in figures.items() if seconds > 10.0} == {}
