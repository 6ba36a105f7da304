"""Which message type is meant by one that does not exist."""

from __future__ import annotations

import pytest

from swarmctl.ros_packages.message_catalog import common_messages
from swarmctl.ros_packages.message_types import no_message


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("geometry_msgs/Odometry", "nav_msgs/Odometry"),
        ("geometry_msgs/twist", "geometry_msgs/Twist"),
        ("geometry_msgs/Twists", "geometry_msgs/Twist"),
        ("sensor_msgs/LaserScans", "sensor_msgs/LaserScan"),
        ("std_msgs/Twist", "geometry_msgs/Twist"),
        ("nav_msgs/OcupancyGrid", "nav_msgs/OccupancyGrid"),
        ("tf2_msgs/tfMessage", "tf2_msgs/TFMessage"),
        ("tf/TFMessage", "tf/tfMessage"),
        ("std_msgs/Float6", "std_msgs/Float64"),
        ("std_srvs/Empty", "std_msgs/Empty"),
        ("geomtry_msgs/Twist", "geometry_msgs/Twist"),
        ("geometry_msg/Twist", "geometry_msgs/Twist"),
    ],
)
def test_the_type_that_is_meant_comes_first(written: str, meant: str) -> None:
    found = no_message(written, common_messages())
    assert found is not None
    assert meant in found.meant[:2]


@pytest.mark.parametrize(
    "kind", ["tf/tfMessage", "my_robot/Odometry", "robot_msgs/lower_case", "mavros_msgs/State", "nav2/Path"]
)
def test_a_type_that_exists_or_may_exist_is_right(kind: str) -> None:
    assert no_message(kind, common_messages()) is None


def test_only_a_known_package_makes_it_certain() -> None:
    wrong, misspelt = (
        no_message(kind, common_messages()) for kind in ("std_msgs/Twist", "sensors_msgs/Image")
    )
    assert wrong is not None
    assert wrong.certain
    assert misspelt is not None
    assert not misspelt.certain
