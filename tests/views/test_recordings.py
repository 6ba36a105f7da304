"""What `swarmctl record` prints of a host: what was left out, how a bag that was not closed is repaired."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import pytest
from swarm_onboard.agent.bags import Recording

from swarmctl.remote.host_recordings import Fetched
from swarmctl.views.recordings import lines


def recording(ended: Literal["lost", "stopped"], output: str = "") -> Recording:
    return Recording(False, 1.0, ["/a", "/b"], ended, 0, output, {}, 0)


@pytest.mark.parametrize(
    ("name", "repair"),
    [
        ("pi_0.bag.active", "rosbag reindex pi_0.bag.active"),
        ("pi_0.mcap.active", "mcap recover pi_0.mcap.active -o pi_0.mcap"),
    ],
)
def test_a_bag_that_was_not_closed_has_its_repair(name: str, repair: str) -> None:
    found = Fetched("pi", recording("lost"), {Path("bags", name): 1_000_000})
    assert list(lines(found)) == [
        "pi  2 topics until the recorder was gone, as after a power cut",
        f"    bags/{name}  1.0 MB",
        f"        it was not closed; `{repair}` repairs it",
    ]


def test_what_the_recorder_printed_is_shown() -> None:
    text = "not recorded, as this host lacks the type: other_msgs/msg/Odd"
    found = Fetched("pi", recording("stopped", f"{text}\x1b"), {Path("pi_0.mcap"): 1_000_000})
    assert list(lines(found)) == ["pi  2 topics", f"    {text}\\x1b", "    pi_0.mcap  1.0 MB"]
