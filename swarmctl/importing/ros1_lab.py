"""Drafts a spec of ROS 1 from launch files and scripts with ROS variables."""

from __future__ import annotations

from collections.abc import Mapping

from swarmctl.importing.draft import Draft
from swarmctl.importing.lab_draft import MULTIMASTERS, Lab
from swarmctl.importing.lab_folder import LabFolder, is_launch_xml
from swarmctl.importing.lab_scripts import Ros
from swarmctl.importing.launched_files import found_in, nodes_in, unread, whole_folder
from swarmctl.importing.recognition import driver_files
from swarmctl.robot_types.any_robot_type import AnyRobotType
from swarmctl.ros_packages.launch_files import (
    Launched,
    evaluate,
)
from swarmctl.ros_packages.package import Package
from swarmctl.ros_packages.xml_launch import is_of_ros_2


def draft_from_launch(
    folder: LabFolder, types: Mapping[str, AnyRobotType], draft: Draft | None = None
) -> Draft:
    """Returns the draft from the launch files and scripts of a folder; ``types`` are the robot types.

    ``draft`` has what an inventory says, if there is one.
    """
    _, packages = whole_folder(folder)
    closed = driver_files(packages, types)

    def is_launch(path: str) -> bool:
        text = folder.texts[path]
        return is_launch_xml(path) and "<launch" in text and not is_of_ros_2(path, text)

    def evaluated(
        package: Package, path: str, given: Mapping[str, str | None], namespace: str, limit: int
    ) -> Launched:
        return evaluate(package, path, given, namespace or "/", packages, limit=limit, closed=closed)

    found = found_in(folder, Ros.ONE, types, is_launch, evaluated)
    launched = found.launched
    lab = Lab(types, found, draft or Draft("launch files and scripts"))
    for machine in (machine for one in launched.values() for machine in one.machines):
        lab.add_machine(machine)
    lab.add_scripts(found.started)
    for paths, node in nodes_in(launched):
        if node.certain and node.package in MULTIMASTERS:
            lab.fkie.add_hosts(node, launched[paths[0]])
    if found.starts_nodes:
        lab.add_any_host("it starts all nodes")
    lab.add_nodes(launched)
    lab.add_services(found.services, {})
    lab.add_masters()
    lab.add_parameters(launched)
    lab.draft.unread += (*lab.unknown.unread(), *unread(launched))
    return lab.draft
