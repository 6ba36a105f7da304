"""Three hosts with rospy, roscpp, rosout and roslaunch, and the guard before their master."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import image, processes
from tests.onboard.gate.ros_host import run_isolated

EPUCK = "from 10.9.0.4 (epuck-pi)"


@pytest.fixture(scope="module")
def found() -> Any:
    """What `three_hosts.py` prints, if this machine can have the lab's image."""
    try:
        processes.require("unshare", "nsenter", "ip", "mount", "mmdebstrap")
    except LabError as error:
        pytest.skip(f"no lab here: {error}")
    return run_isolated(Path(__file__).parent / "three_hosts.py", image.ensure(lambda _line: None))


@pytest.mark.lab
def test_the_guard_listens_and_no_master_behind_it(found: Any) -> None:
    assert found["listens"] == ["10.9.0.2", "127.0.0.1"]


@pytest.mark.lab
def test_nodes_receive_from_the_robot_and_nobody_in_its_place(found: Any) -> None:
    assert found["received"] == ["/k3/driver"]
    refused = f"refused: registerPublisher /imposter /k3/odom {EPUCK}: k3-pi may publish /k3/odom"
    assert refused in found["journal"]


@pytest.mark.lab
def test_roslaunch_on_a_robot_starts_a_node_of_roscpp(found: Any) -> None:
    assert found["roslaunch"] == [1, "Parameter [/k3/rate]", 3]


@pytest.mark.lab
def test_the_master_sets_the_run_id_and_nobody_else_does(found: Any) -> None:
    assert found["run_id"] == 1
    assert found["refused"] == {"name": -1, "run_id": -1, "shutdown": -1}


@pytest.mark.lab
def test_other_parameters_are_read_while_it_runs(found: Any) -> None:
    """The script waits until they are; the nodes are still registered."""
    assert found["after"] == 1


@pytest.mark.lab
def test_it_has_what_roscore_brings(found: Any) -> None:
    """The script waits until a rosout that was killed has registered again."""
    distro, version = found["parameters"]
    assert distro == "noetic\n"
    assert version.startswith("1.")
    assert (found["exit status"], found["rosout ends"]) == (0, True)
