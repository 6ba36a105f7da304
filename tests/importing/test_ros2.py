"""Labs of ROS 2: their launch files, scripts and variables become a draft of ROS 2."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from swarmctl.importing.drafting import DraftError, Kind
from tests.importing.drafts import data, draft, lab

ROBOTS = """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, GroupAction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node, PushRosNamespace


def generate_launch_description():
    robots = [{"name": "tb_1", "x": 0.0}, {"name": "tb_2", "x": 1.0}]
    actions = [DeclareLaunchArgument("rate", default_value="10.0")]
    for robot in robots:
        actions.append(GroupAction([
            PushRosNamespace(robot["name"]),
            Node(package="my_driver", executable="driver", name="base",
                 parameters=[{"start_x": robot["x"], "rate": LaunchConfiguration("rate")}],
                 remappings=[("scan", "laser/scan")]),
        ]))
    return LaunchDescription(actions)
"""
DRIVER = """
from launch import LaunchDescription
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import PathJoinSubstitution
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    file = PathJoinSubstitution([FindPackageShare("turtlebot4_bringup"), "launch", "robot.launch.py"])
    other = PathJoinSubstitution([FindPackageShare("slam_toolbox"), "launch", "on.py"])
    return LaunchDescription([
        IncludeLaunchDescription(
            PythonLaunchDescriptionSource(file), launch_arguments={"namespace": "tb"}.items()
        ),
        IncludeLaunchDescription(
            PythonLaunchDescriptionSource(other), launch_arguments=[("use_sim_time", "false")]
        ),
    ])
"""


def imported(folder: Path, kind: Kind | None = None, **files: str) -> Any:
    return data(draft(lab(folder, {name.replace("__", "."): text for name, text in files.items()}), kind))


def test_nodes_of_a_python_file_are_programs(tmp_path: Path) -> None:
    found = imported(tmp_path, robots__launch__py=ROBOTS)
    assert found["ros"] == {"distro": "jazzy"}
    first = found["programs"]["base"]
    assert first == {
        "host": "robot-pc",
        "package": "my_driver",
        "executable": "driver",
        "params": {"start_x": 0.0, "rate": 10.0},
        "remap": {"scan": "laser/scan"},
        "namespace": "tb_1",
    }
    assert [one["namespace"] for one in found["programs"].values()] == ["tb_1", "tb_2"]


def test_a_node_without_a_name_is_a_guess(tmp_path: Path) -> None:
    text = "<launch><node pkg='p' exec='talker'/></launch>"
    made = draft(lab(tmp_path, {"a.launch.xml": text}))
    why = "guess: its launch file names no node; this is its executable (a.launch.xml:1)"
    assert f"  talker:  # {why}" in made.text


def test_an_include_of_a_driver_is_a_robot_and_any_other_a_program(tmp_path: Path) -> None:
    found = imported(tmp_path, lab__launch__py=DRIVER)
    assert found["robots"] == {"tb": {"type": "turtlebot4", "host": "robot-pc"}}
    assert found["programs"]["on"] == {
        "host": "robot-pc", "package": "slam_toolbox", "launch": "on.py", "args": {"use_sim_time": "false"},
    }  # fmt: skip


def test_an_include_of_a_driver_of_ros_1_is_a_robot(tmp_path: Path) -> None:
    include = '<include file="$(find turtlebot3_bringup)/launch/turtlebot3_robot.launch"/>'
    found = imported(tmp_path, two__launch=f'<launch><group ns="tb3_0">{include}</group></launch>')
    assert found["robots"] == {"tb3-0": {"type": "turtlebot3-burger", "host": "robot-pc"}}
    assert "ros" not in found


@pytest.mark.parametrize(
    ("name", "package", "file"),
    [
        ("a.launch.xml", "$(find-pkg-share turtlebot4_bringup)", "robot.launch.py"),
        ("a.launch", "$(find turtlebot3_bringup)", "turtlebot3_robot.launch"),
    ],
)
def test_an_include_that_may_not_apply_is_no_fact(tmp_path: Path, name: str, package: str, file: str) -> None:
    condition = "$(optenv REAL true)" if name == "a.launch" else "$(env REAL true)"
    elsewhere = package.replace("turtlebot", "other")
    text = f"""
<launch><group if="{condition}">
  <include file="{package}/launch/{file}"/>
  <include file="{elsewhere}/launch/map.launch"/>
</group></launch>
"""
    made = draft(lab(tmp_path, {name: text}))
    found = data(made)
    assert (found["robots"], found.get("programs")) == (None, None)
    assert f"#   {name}:3: whether it applies depends on {condition.split(maxsplit=1)[0]} REAL)" in made.text
    assert (
        f"# fill in: {name}:4: whether it applies depends on {condition.split(maxsplit=1)[0]} REAL)"
        in made.text
    )


def test_variables_of_a_script_are_the_key_ros(tmp_path: Path) -> None:
    text = """
source /opt/ros/humble/setup.bash
export RMW_IMPLEMENTATION=rmw_fastrtps_cpp
export ROS_DOMAIN_ID=7
export ROS_DISCOVERY_SERVER="192.168.77.106:11811;192.168.77.41:11811;;192.168.77.112:11900;"
export CYCLONEDDS_URI=file:///etc/cyclone.xml
"""
    made = draft(lab(tmp_path, {"setup.bash": text}))
    found = data(made)
    assert found["ros"] == {
        "distro": "humble", "rmw": "fastrtps", "domain": 7, "servers": ["server-1", "server-2", "server-3"],
    }  # fmt: skip
    assert [one["address"] for one in found["hosts"].values()] == [
        "192.168.77.106", "192.168.77.41", "192.168.77.112",
    ]  # fmt: skip
    for line in (
        "setup.bash:5: place 2 of ROS_DISCOVERY_SERVER is empty: the servers of a spec have the numbers",
        "setup.bash:5: port 11900; swarmctl takes 11811",
        "setup.bash:6: CYCLONEDDS_URI is file:///etc/cyclone.xml, which has no key in a spec",
    ):
        assert f"#   {line}" in made.text


@pytest.mark.parametrize(
    ("line", "ros"),
    [
        ("export ROS_LOCALHOST_ONLY=1", {"discovery": "local"}),
        ("export ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET", {"discovery": "multicast"}),
        ("export RMW_IMPLEMENTATION=rmw_zenoh_cpp", {"rmw": "zenoh"}),
        ("export ROS_DOMAIN_ID=200", {}),
        (f"export ROS_DOMAIN_ID={'9' * 5000}", {}),
        (f"export ROS_DOMAIN_ID=500 ROS_DISCOVERY_SERVER=10.0.0.1:{'9' * 5000}", {}),
        ("export ROS_DOMAIN_ID=$(id -u)", {}),
    ],
)
def test_each_variable_has_its_key_or_is_not_read(tmp_path: Path, line: str, ros: dict[str, str]) -> None:
    made = draft(lab(tmp_path, {"env.sh": f"{line}\nexport RMW_IMPLEMENTATION=x\n" if not ros else line}))
    assert data(made)["ros"] == {"distro": "jazzy", **ros}
    assert ros or "env.sh:1: ROS_DOMAIN_ID" in made.text


def test_what_of_a_file_is_not_known_has_its_reason(tmp_path: Path) -> None:
    text = ROBOTS.replace("robots = [", "robots = open('robots.txt') or [")
    made = draft(lab(tmp_path, {"robots.launch.py": text, "b.launch.py": ROBOTS}))
    assert "#   robots.launch.py:11: what is below this `for` depends on the text of robots.txt" in made.text


def test_no_secret_of_a_launch_file_is_copied(tmp_path: Path) -> None:
    nodes = (
        (
            "Node(package='p', executable='e', name='n', arguments=['--password', 'hunter2'],"
            " parameters=[{'token': 'hunter2'}], additional_env={'API_KEY': 'hunter2'})"
        ),
        "ExecuteProcess(cmd=['mount', '--password', 'hunter2'])",
        (
            "IncludeLaunchDescription(PythonLaunchDescriptionSource("
            "'$(find-pkg-share p)/x.launch.py'), launch_arguments={'wifi_psk': 'hunter2'}.items())"
        ),
        "SetEnvironmentVariable('MQTT_URL', 'mqtt://me:hunter2@10.0.0.1')",
        "Node(package='p', executable='e', name='x', parameters=[{'a': Command(['x --psk=hunter2'])}])",
        "Node(package='p', executable='e', name='m')",
    )
    text = f"def generate_launch_description():\n    return LaunchDescription([{', '.join(nodes)}])\n"
    made = draft(
        lab(tmp_path, {"a.launch.py": text, "env.sh": "export CYCLONEDDS_URI=http://a:hunter2@b/c\n"})
    )
    assert "hunter2" not in made.text
    assert made.text.count("secret") >= 6


def test_files_of_both_are_not_mixed(tmp_path: Path) -> None:
    node = '<launch><node pkg="p" type="e" name="n"/></launch>'
    folder = lab(tmp_path, {"robots.launch.py": ROBOTS, "old.launch": node})
    with pytest.raises(DraftError, match="several kinds of files"):
        draft(folder)
    assert "n" in data(draft(folder, Kind.LAUNCH))["programs"]
    assert "base" in data(draft(folder, Kind.ROS_2))["programs"]


def test_a_python_file_that_is_no_launch_file_is_left(tmp_path: Path) -> None:
    with pytest.raises(DraftError, match="nothing that can be imported"):
        draft(lab(tmp_path, {"launch/helper.py": "x = 1\n"}))


PARTS = """
from launch import LaunchDescription
from launch.substitutions import EnvironmentVariable, LaunchConfiguration, PythonExpression
from launch_ros.actions import ComposableNodeContainer, Node, PushRosNamespace
from launch_ros.descriptions import ComposableNode
from nav2_common.launch import RewrittenYaml

def generate_launch_description():
    return LaunchDescription([
        ComposableNodeContainer(
            name='cameras', namespace='', package='rclcpp_components', executable='component_container',
            composable_node_descriptions=[
                ComposableNode(
                    package='camera', plugin='camera::Node', name='front', namespace='tb_1',
                    parameters=[{'rate': 30, 'size': '1080'}, {'token': 'hunter2'}],
                    remappings=[('image', 'front/image')]),
            ]),
        Node(package='nav', executable='planner', parameters=[
            RewrittenYaml(source_file='config/nav.yaml', param_rewrites={'use_sim_time': 'true'})]),
        Node(package='p', executable='chosen', name=PythonExpression(["'a' + '", 'b', "'"])),
        PushRosNamespace(EnvironmentVariable('ROBOT', default_value='tb_9')),
        Node(package='p', executable='e', name='somewhere'),
    ])
"""
NAV = """\
planner:
  ros__parameters: {use_sim_time: false, speed: 0.2}
controller:
  ros__parameters: {speed: 0.3}
"""


def test_components_files_that_nav2_rewrites_and_unknown_namespaces(tmp_path: Path) -> None:
    made = draft(lab(tmp_path, {"a.launch.py": PARTS, "config/nav.yaml": NAV}))
    programs = data(made)["programs"]
    assert programs["front"]["command"] == [
        "ros2", "component", "standalone", "camera", "camera::Node", "-n", "front",
        "--node-namespace", "/tb_1", "-r", "image:=front/image", "-p", "rate:=30", "-p", 'size:="1080"',
    ]  # fmt: skip
    assert programs["planner"]["params"] == {"use_sim_time": True, "speed": 0.2}
    assert programs["ab"]["executable"] == "chosen"
    assert "namespace" not in programs["somewhere"]
    for line in (
        "    # namespace: robot  # fill in: a.launch.py:22: `namespace` depends on $(env ROBOT), by default ",
        "#   a.launch.py:10: a container of components, of which each runs on its own",
        "#   a.launch.py:13: token may be a secret",
        "#   config/nav.yaml: its parameters of /controller: no node that gets this file has that name",
    ):
        assert line in made.text
    assert "hunter2" not in made.text


def test_a_driver_that_lies_in_the_folder_is_its_robot(tmp_path: Path) -> None:
    """Not the nodes that its launch files start."""
    driver = '<launch><node pkg="turtlebot3_node" exec="turtlebot3_ros" name="n"/>{}</launch>'
    include = '<include file="$(find-pkg-share turtlebot3_bringup)/launch/{}"/>'
    group = f'<group><push_ros_namespace namespace="tb_1"/>{include.format("robot.launch.py")}</group>'
    python = (
        "def generate_launch_description():\n"
        "    return LaunchDescription([IncludeLaunchDescription('state.launch.xml')])\n"
    )
    files = {
        "src/turtlebot3_bringup/package.xml": "<package><name>turtlebot3_bringup</name></package>",
        "src/turtlebot3_bringup/launch/robot.launch.py": python,
        "src/turtlebot3_bringup/launch/state.launch.xml": driver.format(""),
    }
    alone = data(draft(lab(tmp_path / "alone", files)))
    assert ([*alone["robots"]], alone.get("programs")) == (["turtlebot3-burger"], None)
    fleet = data(draft(lab(tmp_path / "fleet", {**files, "fleet.launch.xml": f"<launch>{group}</launch>"})))
    assert ([*fleet["robots"]], fleet.get("programs")) == (["tb-1"], None)


def test_a_parameter_of_all_nodes_is_that_of_each(tmp_path: Path) -> None:
    text = (
        '<launch><set_parameter name="use_sim_time" value="true"/><node pkg="p" exec="e" name="n"/></launch>'
    )
    programs = data(draft(lab(tmp_path, {"a.launch.xml": text})))["programs"]
    assert programs["n"]["params"] == {"use_sim_time": True}


def test_a_file_that_two_others_include_starts_two_nodes(tmp_path: Path) -> None:
    node = '<node pkg="p" exec="e" name="n"><param name="size" value="{}"/></node>'
    inner = f'<launch><arg name="size" default="1"/>{node}</launch>'
    include = '<include file="$(dirname)/inner.launch.xml"><arg name="size" value="{}"/></include>'
    outer = f"<launch>{include}</launch>"
    files = {
        "inner.launch.xml": inner.format("$(var size)"),
        "a.launch.xml": outer.format(1), "b.launch.xml": outer.format(2), "c.launch.xml": outer.format(2),
    }  # fmt: skip
    programs = data(draft(lab(tmp_path, files)))["programs"]
    assert [one["params"]["size"] for one in programs.values()] == [1, 2]


def test_what_a_running_launch_decides_has_its_line(tmp_path: Path) -> None:
    text = """
def setup(context):
    where = LaunchConfiguration('where').perform(context)
    if where:
        remaps = [('/tf', where)]
    return [Node(package='p', executable='e', name='n')]

def generate_launch_description():
    return LaunchDescription([
        DeclareLaunchArgument('where', default_value=EnvironmentVariable('ROBOT')),
        OpaqueFunction(function=setup),
    ])
"""
    made = draft(lab(tmp_path, {"a.launch.py": text}))
    assert "n" in data(made)["programs"]
    assert "#   a.launch.py:4: what is below this `if` depends on $(env ROBOT)\n" in made.text


def test_an_argument_that_only_an_include_may_use_has_its_value(tmp_path: Path) -> None:
    text = """<launch>
<arg name="fcu_url" default="udp://:14540@10.0.0.1"/>
<include file="$(find-pkg-share other)/launch/fcu_url.launch"/>
</launch>"""
    made = draft(lab(tmp_path, {"a.launch.xml": text}))
    assert "#   a.launch.xml:2: no node here uses the argument fcu_url (`udp://:14540@10.0.0.1`)" in made.text
