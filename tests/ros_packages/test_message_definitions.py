"""Message definitions and their checksums: the sums of packages that genmsg built, and its grammar."""

from __future__ import annotations

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from swarmctl import resources
from swarmctl.ros_packages.message_catalog import common_messages
from swarmctl.ros_packages.message_definitions import (
    DefinitionError,
    checksums,
    definition_of,
    messages_of_action,
)

#: `_md5sum` in the Python code of Debian's python3-*-msgs packages.
BUILT = {
    "std_msgs/Header": "2176decaecbce78abc3b96ef049fabed",
    "std_msgs/Empty": "d41d8cd98f00b204e9800998ecf8427e",
    "std_msgs/UInt16MultiArray": "52f264f1c973c4b73790d384c6cb4484",
    "geometry_msgs/Twist": "9f195f881246fdfa2798d1d3eebca84a",
    "geometry_msgs/PoseWithCovarianceStamped": "953b798c0f514ff060a53a3498ce6246",
    "nav_msgs/Odometry": "cd5e73d190d741a2f92e81eda573aca7",
    "nav_msgs/OccupancyGrid": "3381f2d731d4076ec5c71b0759edbe4e",
    "nav_msgs/GetMapActionResult": "ac66e5b9a79bb4bbd33dab245236c892",
    "sensor_msgs/Image": "060021388200f6f0f447d0fcd9c64743",
    "sensor_msgs/LaserScan": "90c7ef2dc6895d81024acba2ac42f369",
    "sensor_msgs/BatteryState": "4ddae7f048e32fda22cac764685e3974",
    "sensor_msgs/NavSatFix": "2d3a8cd499b9b4a0249fb98fd05cfa48",
    "sensor_msgs/PointCloud2": "1158d486dd51d683ce2f1be655c3c181",
    "tf2_msgs/TFMessage": "94810edda583a504dfda3829e70d7eec",
    "tf2_msgs/LookupTransformAction": "7ee01ba91a56c2245c610992dbaa3c37",
    "diagnostic_msgs/DiagnosticArray": "60810da900de1dd6ddd437c3503511da",
    "diagnostic_msgs/DiagnosticStatus": "d0ce08bc6e5ba34c7754f563a9cabaf1",
    "visualization_msgs/InteractiveMarkerUpdate": "710d308d0a9276d65945e92dd30b3946",
    "actionlib_msgs/GoalStatusArray": "8b2b82f13216d0a8ea88bd3af735e619",
    "stereo_msgs/DisparityImage": "04a177815f75271039fa21f16acad8c9",
    "rosgraph_msgs/Log": "acffd30cd6b6de30f120938c17c593fb",
    "shape_msgs/SolidPrimitive": "d8f8cbc74c5ff283fca29569ccefb45d",
    "trajectory_msgs/MultiDOFJointTrajectory": "ef145a45a5f47b77b7f5cdde4b16c942",
    "move_base_msgs/MoveBaseAction": "70b6aca7c7f7746d8d1609ad94c80bb8",
    "map_msgs/ProjectedMap": "7bbe8f96e45089681dc1ea7d023cbfca",
    "bond/Status": "eacc84bf5d65b6777d4c50f463dfb9c8",
    "dynamic_reconfigure/ConfigDescription": "757ce9d44ba8ddd801bb30bc456f946f",
}
HEADER = "uint32 seq\ntime stamp\nstring frame_id\n"


@pytest.mark.parametrize("kind", BUILT)
def test_the_catalog_has_the_sums_that_nodes_have(kind: str) -> None:
    assert common_messages().sums[kind] == BUILT[kind]


def test_the_catalog_has_every_message_whose_size_is_known() -> None:
    measured = yaml.safe_load((resources.templates() / "data/message_sizes.yaml").read_text("utf-8"))
    assert set(measured) <= common_messages().sums.keys()


def test_both_names_of_transforms_have_one_sum() -> None:
    assert common_messages().sums["tf/tfMessage"] == common_messages().sums["tf2_msgs/TFMessage"]


def sum_of(text: str, kind: str = "std_msgs/Header") -> str | None:
    return checksums({kind: definition_of(text, kind.partition("/")[0])}, common_messages().sums).get(kind)


def test_a_definition_has_the_sum_of_genmsg() -> None:
    assert sum_of(HEADER) == BUILT["std_msgs/Header"]


def test_comments_and_blank_lines_do_not_change_the_sum() -> None:
    written = "# number\r\nuint32   seq # of it\r\n\r\n time stamp\r\nstring frame_id"
    assert sum_of(written) == BUILT["std_msgs/Header"]


def test_constants_stand_before_fields_and_keep_their_text() -> None:
    text = (
        "byte level\nbyte OK=0\nbyte WARN = 1\nbyte ERROR=2\nbyte STALE=3\n"
        "string name\nstring message\nstring hardware_id\nKeyValue[] values\n"
    )
    assert sum_of(text, "diagnostic_msgs/DiagnosticStatus") == BUILT["diagnostic_msgs/DiagnosticStatus"]


def test_a_text_constant_keeps_what_looks_like_a_comment() -> None:
    assert definition_of("string A= b # c\n", "p").constants == ("string A=b # c",)


def test_an_action_becomes_seven_messages() -> None:
    text = "geometry_msgs/PoseStamped target_pose\n---\n---\ngeometry_msgs/PoseStamped base_position\n"
    texts = dict(messages_of_action("MoveBase", text))
    definitions = {
        f"move_base_msgs/{name}": definition_of(one, "move_base_msgs") for name, one in texts.items()
    }
    assert len(definitions) == 7
    sums = checksums(definitions, common_messages().sums)
    assert sums["move_base_msgs/MoveBaseAction"] == BUILT["move_base_msgs/MoveBaseAction"]


def test_a_message_with_an_unknown_field_has_no_sum() -> None:
    assert sum_of("other_msgs/Thing thing\n", "mine/Own") is None


def test_messages_that_contain_each_other_have_no_sum() -> None:
    definitions = {
        "mine/A": definition_of("B b", "mine"),
        "mine/B": definition_of("A a", "mine"),
        "mine/C": definition_of("A a", "mine"),
        "mine/D": definition_of("int8 a", "mine"),
    }
    assert checksums(definitions, {}).keys() == {"mine/D"}


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("int8 a\nint8 a", 1),
        ("int8 a\n\nint8", 3),
        ("int8\ta", 1),
        ("int8 a b", 1),
        ("int8 1a", 1),
        ("int8[x] a", 1),
        ("uint8 A=256", 1),
        ("uint8 A=x", 1),
        ("Thing A=1", 1),
        ("bool A=maybe", 1),
    ],
)
def test_what_genmsg_refuses_is_named_with_its_line(text: str, line: int) -> None:
    with pytest.raises(DefinitionError) as error:
        definition_of(text, "p")
    assert error.value.line == line


@given(st.text(max_size=200))
def test_any_text_is_a_definition_or_an_error(text: str) -> None:
    try:
        one = definition_of(text, "p")
    except DefinitionError:
        return
    assert sum_of(text, "p/Own") is not None or one.types


@given(
    st.lists(st.sampled_from(["int8 a", "string B=x", "float64[3] c", "Header d"]), unique=True),
    st.text("# \r"),
)
def test_layout_never_changes_the_sum(lines: list[str], blank: str) -> None:
    blank = blank.lstrip("#")
    assert sum_of("\n".join(lines), "p/Own") == sum_of(f"\n{blank}#\n".join(lines) + "\n#", "p/Own")
