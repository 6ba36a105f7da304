"""Writes templates/data/messages.yaml from the sources of ROS packages.

``python tools/message_catalog.py FOLDER... > templates/data/messages.yaml``, with checkouts (branches of
Noetic) of ros/std_msgs, ros/common_msgs, ros/ros_comm, ros/ros_comm_msgs, ros/geometry, ros/geometry2,
ros/actionlib, ros/common_tutorials, ros/ros_tutorials, ros/dynamic_reconfigure, ros/bond_core,
ros-planning/navigation_msgs, ros-controls/control_msgs, ros-perception/vision_msgs,
ros-drivers/ackermann_msgs, ros-drivers/rosserial and fkie/multimaster_fkie.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import yaml

from swarmctl.ros_packages.message_definitions import checksums, definition_of, messages_of_action

HEAD = """\
# The messages of common ROS 1 packages (Noetic) with the MD5 sums that nodes compare when they connect, and
# the names of their services and actions. Written by tools/message_catalog.py, which names the sources.
"""


def packages_in(folders: list[Path]) -> Iterator[tuple[str, Path]]:
    for folder in folders:
        for manifest in sorted(folder.rglob("package.xml")):
            package = manifest.parent
            has_messages = any((package / kind).is_dir() for kind in ("msg", "srv", "action"))
            if has_messages and not {"test", "tests"} & set(package.relative_to(folder).parts):
                name = manifest.read_text("utf-8").partition("<name>")[2].partition("</name>")[0].strip()
                yield name, package


def names_in(package: Path, kind: str) -> list[str]:
    return sorted(one.stem for one in (package / kind).glob(f"*.{kind}"))


def catalog(folders: list[Path]) -> dict[str, dict[str, object]]:
    packages = {name: package for name, package in packages_in(folders) if not name.startswith("test_")}
    texts: dict[str, str] = {}
    for name, package in packages.items():
        for file in (package / "msg").glob("*.msg"):
            texts[f"{name}/{file.stem}"] = file.read_text("utf-8")
        for file in (package / "action").glob("*.action"):
            messages = messages_of_action(file.stem, file.read_text("utf-8"))
            texts.update((f"{name}/{one}", text) for one, text in messages)
    definitions = {kind: definition_of(text, kind.partition("/")[0]) for kind, text in texts.items()}
    sums = checksums(definitions, {})
    if missing := definitions.keys() - sums.keys():
        raise SystemExit(f"no sources for what these contain: {', '.join(sorted(missing))}")
    written: dict[str, dict[str, object]] = {}
    for name, package in sorted(packages.items()):
        own = {kind.partition("/")[2]: sums[kind] for kind in sorted(sums) if kind.startswith(f"{name}/")}
        others = {"services": names_in(package, "srv"), "actions": names_in(package, "action")}
        written[name] = {"messages": own, **{key: names for key, names in others.items() if names}}
    return written


if __name__ == "__main__":
    made = catalog([Path(one) for one in sys.argv[1:]])
    sys.stdout.write(HEAD + yaml.safe_dump(made, sort_keys=False, width=110, default_flow_style=None))
