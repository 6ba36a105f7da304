"""What package.xml and CMakeLists.txt say about a package."""

from __future__ import annotations

import pytest

from swarmctl.ros_packages.package import package_of
from tests.ros_packages.packages import manifest, package


def test_dependencies_of_every_kind_count() -> None:
    depends = "<depend>b</depend><run_depend> c </run_depend><exec_depend>d</exec_depend>"
    text = f"<package><name>a</name>{depends}</package>"
    found = package_of("a", {}, {"package.xml": text.encode()})
    assert found is not None
    assert found.depends == {"b", "c", "d"}


@pytest.mark.parametrize(
    ("condition", "counts"),
    [
        ("", True),
        ("$ROS_VERSION == 1", True),
        ("$ROS_VERSION == 2", False),
        ("$ROS_VERSION != 2 and $ROS_PYTHON_VERSION == '3'", True),
        ("$ROS_VERSION == 2 and $ROS_DISTRO == humble", True),  # the host decides
        ("($ROS_VERSION == 1 or $ROS_VERSION == 2) and ($ROS_PYTHON_VERSION &lt; 3)", False),
        ("$ROS_VERSION == 2 or $ROS_VERSION == 2 and $ROS_PYTHON_VERSION == 3", False),
        ("$NOT_SET == ''", True),
        ("$ROS_VERSION", True),  # the next are no conditions: the key counts
        ("$ROS_VERSION == 2 ;", True),
        ("$ROS_VERSION == 2 2", True),
        ("(" * 3000 + "$ROS_VERSION == 2", True),
    ],
)
def test_a_key_for_another_ros_does_not_count(condition: str, counts: bool) -> None:
    """As in foxglove_bridge, whose one package.xml serves ROS 1 and ROS 2."""
    text = f'<package format="3"><name>a</name><depend condition="{condition}">b</depend></package>'
    found = package_of("a", {}, {"package.xml": text.encode()})
    assert found is not None
    assert ("b" in found.depends, "b" in found.to_run, "b" in found.to_build) == (counts,) * 3


@pytest.mark.parametrize(
    "text",
    ["", "<package>", "<package />", "<package><name>../a</name></package>",
     "<launch><name>a</name></launch>", "<!DOCTYPE p [<!ENTITY n 'a'>]><package><name>&n;</name></package>"],
)  # fmt: skip
def test_a_folder_without_a_name_is_no_package(text: str) -> None:
    assert package_of("a", {}, {"package.xml": text.encode()}) is None


def test_executables_come_from_scripts_and_from_cmake() -> None:
    cmake = """
        project(moves)
        # add_executable(not_this x.cpp)
        add_executable(${PROJECT_NAME}_node a.cpp)
        cuda_add_executable(fast b.cu)
        set_target_properties(fast PROPERTIES OUTPUT_NAME faster PREFIX "")
        catkin_install_python(PROGRAMS scripts/one.py
          scripts/two.py DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
    """
    files = {"CMakeLists.txt": cmake, "scripts/one.py": "", "nodes/three": "", "scripts/four.py": ""}
    found = package("moves", files, executable=("nodes/three",))
    assert not found.is_computed
    for name in ("moves_node", "fast", "faster", "one.py", "two.py", "three"):
        assert found.executable(name) is True, name
    assert found.executable("four.py") is False
    assert found.executable("not_this") is None


@pytest.mark.parametrize("line", ["foreach(one a b)", "add_executable(${NAME} a.cpp)", "include(more.cmake)"])
def test_names_that_cmake_computes_are_not_known(line: str) -> None:
    assert package("a", {"CMakeLists.txt": f"project(a)\n{line}\n"}).is_computed


def test_a_name_may_be_spelt_as_catkin_allows() -> None:
    found = package_of("x", {}, {"package.xml": manifest("RobotWander").encode()})
    assert found is not None
    assert found.name == "RobotWander"
