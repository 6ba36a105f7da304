"""XML and YAML launch files of ROS 2 start what the same file in Python does."""

from __future__ import annotations

import pytest

from swarmctl.ros_packages import xml_launch
from swarmctl.ros_packages.launch_description import evaluate
from swarmctl.ros_packages.launch_files import Launched
from swarmctl.ros_packages.launch_values import Unknown
from swarmctl.ros_packages.package import Package

READERS = {".xml": xml_launch.read_xml, ".yaml": xml_launch.read_yaml}
XML = """
<launch>
  <arg name="rate" default="10.0"/>
  <group>
    <push-ros-namespace namespace="robot1"/>
    <node pkg="p" exec="e" name="n" args="--rate $(var rate)">
      <param name="rate" value="$(var rate)"/>
      <param name="frame"><param name="id" value="odom"/></param>
      <remap from="chatter" to="news"/>
      <env name="A" value="b"/>
    </node>
    <include file="$(find-pkg-share slam)/launch/online.launch.py"><arg name="map" value="lab"/></include>
  </group>
  <node pkg="p" exec="e" if="$(env SIMULATED false)"/>
  <executable cmd="ls -l"/>
</launch>
"""
YAML = """
launch:
- arg: {name: rate, default: "10.0"}
- group:
  - push_ros_namespace: {namespace: robot1}
  - node:
      pkg: p
      exec: e
      name: n
      args: --rate $(var rate)
      param:
      - {name: rate, value: $(var rate)}
      - name: frame
        param:
        - {name: id, value: odom}
      remap:
      - {from: chatter, to: news}
      env:
      - {name: A, value: b}
  - include:
      file: $(find-pkg-share slam)/launch/online.launch.py
      arg:
      - {name: map, value: lab}
- node: {pkg: p, exec: e, if: $(env SIMULATED false)}
- executable: {cmd: ls -l}
"""


def launched(name: str, text: str) -> Launched:
    package = Package("own", "", frozenset((name,)), {name: False}, {name: text.encode()})
    return evaluate(package, name, {}, READERS, limit=2000)


@pytest.mark.parametrize(("name", "text"), [("a.launch.xml", XML), ("a.launch.yaml", YAML)])
def test_what_a_file_starts_is_known(name: str, text: str) -> None:
    found = launched(name, text)
    node, perhaps, process = found.nodes
    assert (node.name, node.package, node.executable, node.arguments) == (
        "/robot1/n",
        "p",
        "e",
        "--rate 10.0",
    )
    assert [(one.name, one.value) for one in node.parameters] == [("rate", "10.0"), ("frame.id", "odom")]
    assert node.remaps == (("chatter", "news"),)
    assert [(one.name, one.value) for one in node.environment] == [("A", "b")]
    assert [(one.package, one.file, one.namespace, one.arguments) for one in found.includes] == [
        ("slam", "launch/online.launch.py", "robot1", {"map": "lab"})
    ]
    assert (perhaps.certain, [*found.unknown.values()]) == (False, ["$(env SIMULATED), by default `false`"])
    assert (process.package, process.executable, process.arguments) == ("", "ls", "-l")
    assert found.left_out == []


@pytest.mark.parametrize(
    ("name", "text", "why"),
    [
        ("a.launch.xml", "<launch>", "it is not well-formed XML"),
        ("a.launch.xml", "<robot/>", "it has no element <launch>"),
        ("a.launch.yaml", "launch: [", "it is not valid YAML"),
        ("a.launch.yaml", "nodes: []", "it has no `launch:`"),
    ],
)
def test_a_file_that_no_launch_reads_is_named(name: str, text: str, why: str) -> None:
    assert [one for _, one in launched(name, text).left_out] == [why]


@pytest.mark.parametrize(
    ("text", "of_ros_2"),
    [
        ('<launch><node pkg="p" exec="e"/></launch>', True),
        ('<launch><include file="$(find-pkg-share p)/x"/></launch>', True),
        ('<launch><node pkg="p" type="e" name="n"/></launch>', False),
        ('<launch><include file="$(find p)/x"/></launch>', False),
    ],
)
def test_files_of_ros_1_and_ros_2_are_recognised(text: str, of_ros_2: bool) -> None:
    assert xml_launch.is_of_ros_2("a.launch", text) is of_ros_2
    assert xml_launch.is_of_ros_2("a.launch.xml", text) is of_ros_2


def test_a_file_that_both_could_read_is_of_the_one_its_name_says() -> None:
    text = '<launch><include file="$(dirname)/x"/></launch>'
    assert xml_launch.is_of_ros_2("a.launch.xml", text)
    assert not xml_launch.is_of_ros_2("a.launch", text)


def test_substitutions_within_each_other_are_read() -> None:
    text = '<launch><arg name="p" default="q"/><include file="$(find-pkg-share $(var p))/x.py"/></launch>'
    assert [one.package for one in launched("a.launch.xml", text).includes] == ["q"]
    assert isinstance(xml_launch.text_of("$(command 'xacro x')"), Unknown)
    assert xml_launch.text_of("$(" * 60) is not None
