"""``swarmctl record`` where nothing can be recorded: what it advises."""

from __future__ import annotations

import pytest

from swarmctl.cli import exit_codes
from tests import ROOT
from tests.in_process import swarmctl


@pytest.mark.parametrize("lab", [True, False])
def test_a_swarm_of_ros_2_is_recorded_by_a_program_of_a_real_host(lab: bool) -> None:
    done = swarmctl("record", *(["--lab"] if lab else []), cwd=ROOT / "examples/ros2-2-leader")
    assert done.returncode == exit_codes.USAGE
    words = " ".join(done.stderr.split())
    assert "record runs rosbag, which `ros.distro: jazzy` has not" in words
    assert "`command: [ros2, bag, record, -a]`; its host needs the Debian package ros-jazzy-rosbag2" in words
    assert words.endswith(", which no host of a lab has") is lab
