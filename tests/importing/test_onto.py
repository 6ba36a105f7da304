"""`import --onto SPEC`: what the files of a lab have and a spec has not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from swarmctl.importing.drafting import compared
from swarmctl.linter.runner import check_files
from swarmctl.spec.load import Document
from tests.importing.drafts import draft, lab

IMAGE = f"sha256:{'0' * 64}"
SCRIPT = """\
source /opt/ros/jazzy/setup.bash
export ROS_DOMAIN_ID=7
ssh pi@192.168.77.21 "ros2 launch turtlebot3_bringup robot.launch.py namespace:=tb_1"
ssh pi@192.168.77.22 "ros2 launch turtlebot3_bringup robot.launch.py namespace:=tb_2"
ssh pi@192.168.77.21 "ros2 run camera node --ros-args -p rate:=30 -p width:=640 -r image:=/tb_1/image"
"""


def document_in(text: str) -> Document:
    """The document of a spec, which may have findings."""
    document, findings = check_files(Path("swarm.yaml"), read=lambda *_: text.encode())
    assert document is not None, findings
    return document


def beyond(folder: Path, change: Any) -> Any:
    """What the lab has beyond its own draft, which ``change`` edits as data."""
    found = yaml.safe_load(draft(folder).text)
    change(found)
    text = yaml.safe_dump(found, sort_keys=False)
    shown = compared(folder, None, document_in(text), Path("swarm.yaml"))
    return yaml.safe_load(shown.text)


def test_a_spec_with_all_of_it_has_no_difference(tmp_path: Path) -> None:
    assert beyond(lab(tmp_path, {"start.sh": SCRIPT}), lambda _: None) is None


def test_names_of_a_spec_are_its_own(tmp_path: Path) -> None:
    """A host is known by its address, a robot by its namespace, a program by what it starts and where."""

    def renamed(spec: Any) -> None:
        text = yaml.safe_dump(spec, sort_keys=False)
        for old, new in (("host-192-168-77-21", "front"), ("tb-2", "rear-robot"), ("node:", "camera:")):
            text = text.replace(old, new)
        spec.clear()
        spec.update(yaml.safe_load(text))
        spec["robots"]["rear-robot"]["namespace"] = "tb_2"

    assert beyond(lab(tmp_path, {"start.sh": SCRIPT}), renamed) is None


def test_each_container_is_its_own(tmp_path: Path) -> None:
    """A draft does not know their images, so they are known by their names."""
    services = (
        "services:\n  router: {image: r, environment: {A: 1}}\n  camera: {image: c, environment: {A: 1}}\n"
    )

    def one_only(spec: Any) -> None:
        spec["hosts"]["robot-pc"]["address"] = "10.0.0.1"
        spec["programs"] = {"router": {**spec["programs"]["router"], "container": {"image": IMAGE}}}
        spec["robots"] = {"k3": {"type": "khepera3", "host": "robot-pc"}}
        spec["links"] = [{"kind": "serial", "host": "robot-pc", "robot": "k3", "device": "/dev/ttyS0"}]

    found = beyond(lab(tmp_path, {"compose.yaml": services}), one_only)
    assert list(found["programs"]) == ["camera"]


def test_a_host_and_a_robot_of_one_name_are_two(tmp_path: Path) -> None:
    def renamed(spec: Any) -> None:
        spec["hosts"] = {"pi": spec["hosts"]["tb-1"]}
        spec["leader"] = spec["robots"]["tb-1"]["host"] = "pi"

    script = 'ssh pi@tb-1 "ros2 launch turtlebot3_bringup robot.launch.py namespace:=tb_1"\n'
    assert beyond(lab(tmp_path, {"start.sh": script}), renamed) is None


def test_what_is_missing_or_other_is_shown(tmp_path: Path) -> None:
    def changed(spec: Any) -> None:
        del spec["robots"]["tb-2"]
        spec["hosts"]["host-192-168-77-21"]["user"] = "ros"
        spec["ros"]["domain"] = 8
        del spec["programs"]["node"]["params"]["width"]
        del spec["programs"]["node"]["remap"]

    folder = lab(tmp_path, {"start.sh": SCRIPT})
    found = beyond(folder, changed)
    assert found == {
        "ros": {"domain": 7},
        "hosts": {"host-192-168-77-21": {"user": "pi"}},
        "robots": {"tb-2": {"type": "turtlebot3-burger", "host": "host-192-168-77-22"}},
        "programs": {"node": {"params": {"width": 640}, "remap": {"image": "/tb_1/image"}}},
    }


def test_what_the_spec_has_instead_stands_behind_the_value(tmp_path: Path) -> None:
    folder = lab(tmp_path, {"start.sh": SCRIPT})
    text = draft(folder).text.replace("user: pi", "user: ros")
    shown = compared(folder, None, document_in(text), Path("swarm.yaml")).text
    assert "    user: pi  # from start.sh:3, the spec has ros\n" in shown
    assert shown.startswith("# What launch files and scripts of ROS 2 has and swarm.yaml has not.\n")
