"""Definitions in MCAP files, as rosbags reads them, from packages with the definitions that ROS has."""

from __future__ import annotations

from pathlib import Path

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from swarm_onboard.ros2_recorder.bag_files import definition

STORE = get_typestore(Stores.ROS2_JAZZY)
KINDS = (
    "nav_msgs/msg/Odometry",
    "sensor_msgs/msg/BatteryState",
    "sensor_msgs/msg/CameraInfo",
    "tf2_msgs/msg/TFMessage",
)


@pytest.fixture
def packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The messages of the types, each file in the second of two spaces."""
    for kind in KINDS:
        text, _ = STORE.generate_msgdef(kind, ros_version=2)
        first, *others = text.split("=" * 80 + "\nMSG: ")
        for name, own in [(kind, first), *((one.split("\n", 1)[0], one.split("\n", 1)[1]) for one in others)]:
            package, *_, short = name.split("/")
            file = tmp_path / "share" / package / "msg" / f"{short}.msg"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(own)
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path}/none:{tmp_path}")
    return tmp_path / "share"


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.usefixtures("packages")
def test_a_definition_has_all_types_that_it_uses_once(kind: str) -> None:
    found = get_types_from_msg(definition(kind), kind)
    assert found == {name: STORE.fielddefs[name] for name in found}
    assert kind in found
    assert "builtin_interfaces/msg/Time" in found
    assert definition(kind).count("MSG: std_msgs/Header\n") == 1


def test_a_type_of_the_same_package_a_comment_and_a_bound(packages: Path) -> None:
    file = packages / "nav_msgs/msg/Own.msg"
    file.write_text(
        'Odometry[<=2] two # geometry_msgs/Nothing here\nstring<=5 name "Twist a"\nuint8 SOME=1\n'
    )
    types = get_types_from_msg(definition("nav_msgs/msg/Own"), "nav_msgs/msg/Own")
    assert {"nav_msgs/msg/Own", "nav_msgs/msg/Odometry", "geometry_msgs/msg/Twist"} <= types.keys()


def test_without_one_of_its_types_there_is_none(packages: Path) -> None:
    (packages / "geometry_msgs/msg/Point.msg").unlink()
    assert definition("nav_msgs/msg/Odometry") == ""
    assert definition("other_msgs/msg/Odd") == ""
