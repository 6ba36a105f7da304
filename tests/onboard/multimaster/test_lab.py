"""The static multimaster with real rosmasters and real rospy nodes, a network namespace for each island."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import image, processes
from tests.timing import Promise

HERE = Path(__file__).parent
SEED = 20151113
EVENTS = 1000

Note = Callable[[str, str, str], None]


@pytest.fixture(scope="module")
def disk() -> Path:
    """The lab's image, if this machine can have one."""
    try:
        processes.require("unshare", "ip", "mount", "mmdebstrap")
    except LabError as error:
        pytest.skip(f"no lab here: {error}")
    return image.ensure(lambda _line: None)


def run(script: str, *arguments: object) -> dict[str, Any]:
    """The figures that ``script`` prints; it runs in namespaces that end with it."""
    argv = (sys.executable, str(HERE / script), *map(str, arguments))
    done = subprocess.run(
        ("unshare", "--net", *processes.isolated(argv)),
        env=processes.environment(), capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-4000:]
    figures: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return figures


@pytest.mark.lab
@pytest.mark.slow
def test_all_masters_match_the_model_after_a_thousand_events(disk: Path, note: Note) -> None:
    figures = run("storm.py", disk, SEED, EVENTS)
    title = f"static multimaster: {figures['events']} events on {figures['topics']} topics, seed {SEED}"
    found = f"{len(figures['leaks'])} leaks, stale: {figures['stale'] or 'nothing'}"
    note(title, f"{figures['seconds']} s, {found}", "no leak, nothing stale")
    note("static multimaster: longest to converge after them", f"{figures['longest_to_converge']} s", "")
    assert figures["stale"] == ""
    assert figures["leaks"] == []
    assert figures["shut_down"] == []
    assert figures["races_for_a_name"] <= 3
    assert (figures["events"], figures["topics"]) == (EVENTS, 30)


@pytest.mark.lab
def test_a_rospy_listener_receives_again_after_every_fault(disk: Path, promise: Promise) -> None:
    figures = run("rospy_conversation.py", disk)
    assert figures.pop("quiet while cut") is True
    assert figures.pop("left behind") == []
    promise("static multimaster: from SIGTERM to its end", figures.pop("sync stopped"), 3)
    for what, seconds in figures.items():
        promise(f"static multimaster, a listener receives again: {what}", seconds, 10)
        assert seconds != math.inf, what
