"""The users' own packages in a release: where they are, who restarts with them, what is not required."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from swarmctl.render.elf import machines_of
from tests.loading import load_swarm
from tests.ros_packages.packages import manifest
from tests.rules.test_packages import write

SPEC = """\
version: 1
name: lab
mode: central
hub: laptop
hosts:
  laptop: {address: 192.168.77.10}
  pi: {address: 192.168.77.11}
robots:
  k3: {type: khepera3, host: pi}
links:
  - {kind: wlan, name: lab, hosts: [laptop, pi]}
  - {kind: serial, host: pi, robot: k3, usb: {serial: FTDI1234}}
packages:
  nav: {from: ./src/nav}
  nav_core: {from: src/core}
programs:
  map: {host: pi, package: nav, executable: go.py}
  log: {host: pi, package: rosbag, executable: record}
"""


@pytest.fixture
def made(tmp_path: Path) -> dict[str, Bundle]:
    write(
        tmp_path,
        {
            "swarm.yaml": SPEC,
            "src/nav/package.xml": manifest("nav", "nav_core"),
            "src/nav/scripts/go.py": "#!/usr/bin/env python3\n",
            "src/core/package.xml": manifest("nav_core"),
            "src/core/src/nav_core/__init__.py": "",
        },
    )
    (tmp_path / "src/nav/scripts/go.py").chmod(0o755)
    swarm, found = load_swarm(tmp_path / "swarm.yaml")
    assert swarm is not None, found
    return dict(bundles(swarm))


def test_only_hosts_whose_programs_use_them_get_them(made: dict[str, Bundle]) -> None:
    inside = {file.path: file.mode for file in made["pi"].files if file.path.startswith("packages/")}
    assert inside == {
        "packages/nav/package.xml": 0o644,
        "packages/nav/scripts/go.py": 0o755,
        "packages/nav_core/package.xml": 0o644,
        "packages/nav_core/src/nav_core/__init__.py": 0o644,
    }
    assert not [file for file in made["laptop"].files if file.path.startswith("packages/")]


def test_a_program_restarts_with_its_packages_only(made: dict[str, Bundle]) -> None:
    needs = {unit.program: unit.needs for unit in made["pi"].units}
    assert "packages/nav_core/src/nav_core/__init__.py" in needs["map"]
    assert not [path for path in needs["log"] if path.startswith("packages/")]


def test_a_workspace_of_the_host_does_not_hide_them(made: dict[str, Bundle]) -> None:
    """roslaunch and rosrun look into spaces of catkin before they look into ROS_PACKAGE_PATH."""
    files = {file.path: file.content.decode() for file in made["pi"].files}
    assert files["built/.catkin"] == "/opt/swarm/lab/current/packages"
    assert 'SWARM_BUILT="/opt/swarm/lab/current/built"' in files["env/ros.env"]
    assert made["pi"].platform == ""
    assert "built/.catkin" not in {file.path for file in made["laptop"].files}


def test_ros_and_python_find_them(made: dict[str, Bundle]) -> None:
    texts = {
        file.path: file.content.decode() for file in made["pi"].files if file.path.endswith((".env", ".bash"))
    }
    for text in (texts["env/ros.env"], texts["setup.bash"]):
        assert "/opt/swarm/lab/current/drivers:/opt/swarm/lab/current/packages:" in text
        assert "/opt/swarm/lab/current/packages/nav_core/src" in text.partition("PYTHONPATH=")[2]


def test_hosts_need_not_have_them(made: dict[str, Bundle]) -> None:
    assert "package:rosbag" in made["pi"].requires
    assert "package:nav" not in made["pi"].requires


@pytest.mark.parametrize(
    ("head", "machines"),
    [
        (b"\x7fELF\x02\x01\x01" + bytes(9) + b"\x03\x00\xb7\x00", ("aarch64",)),
        (b"\x7fELF\x02\x02\x01" + bytes(9) + b"\x00\x03\x00\x3e", ("x86_64",)),
        (b"#!/bin/sh\n" + bytes(20), ()),
        (b"\x7fELF", ()),
    ],
)
def test_a_compiled_file_names_its_machine(head: bytes, machines: tuple[str, ...]) -> None:
    assert machines_of(head) == machines


def test_a_host_has_workspaces_of_its_own(tmp_path: Path) -> None:
    text = SPEC.split("packages:", maxsplit=1)[0].replace(
        "192.168.77.11}", "192.168.77.11, workspaces: [/home/robot/nav, /home/robot/ws]}"
    )
    write(tmp_path, {"swarm.yaml": text})
    swarm, found = load_swarm(tmp_path / "swarm.yaml")
    assert swarm is not None, found
    made = bundles(swarm)
    files = {file.path: file.content.decode() for file in made["pi"].files}
    assert 'SWARM_WORKSPACE="/home/robot/ws /home/robot/nav"' in files["env/ros.env"]  # the last one wins
    assert files["setup.bash"].index("/home/robot/ws") < files["setup.bash"].index("/home/robot/nav")
    assert "BindReadOnlyPaths=-/home/robot/nav\n" in files["units/swarm-lab.k3.service"]
    assert list(made["pi"].requires)[:2] == ["workspace:/home/robot/nav", "workspace:/home/robot/ws"]
    laptop = {file.path: file.content.decode() for file in made["laptop"].files}
    assert "SWARM_WORKSPACE" not in laptop["env/ros.env"]


def test_a_robots_driver_may_be_such_a_package(tmp_path: Path) -> None:
    text = SPEC.replace(
        "{type: khepera3, host: pi}", "{type: khepera3, host: pi, driver: {package: nav, executable: go.py}}"
    ).split("programs:", maxsplit=1)[0]
    write(
        tmp_path,
        {
            "swarm.yaml": text,
            "src/nav/package.xml": manifest("nav"),
            "src/core/package.xml": manifest("nav_core"),
        },
    )
    swarm, found = load_swarm(tmp_path / "swarm.yaml")
    assert swarm is not None, found
    pi = bundles(swarm)["pi"]
    needs = {unit.name: unit.needs for unit in pi.units}
    assert "packages/nav/package.xml" in needs["swarm-lab.k3.service"]
    assert not [one for one in pi.requires if one == "package:nav"]


def test_meshes_of_robots_travel_to_the_host_of_the_master(tmp_path: Path) -> None:
    """RViz is opened there; the host of the robot needs none."""
    urdf = """<robot name="k3"><link name="base_link">
  <visual><geometry><mesh filename="package://k3_description/k3.stl" /></geometry></visual>
</link></robot>"""
    shape = ("k3: {type: khepera3, host: pi}", "k3: {type: khepera3, host: pi, urdf: k3.urdf}")
    package = ("  nav_core: {from: src/core}", "  k3_description: {from: src/shape}")
    text = SPEC.replace(*shape).replace(*package).replace("  nav: {from: ./src/nav}\n", "")
    files = {
        "swarm.yaml": text.replace("  map: {host: pi, package: nav, executable: go.py}\n", ""),
        "k3.urdf": urdf,
        "src/shape/package.xml": manifest("k3_description"),
        "src/shape/k3.stl": "solid k3\nendsolid k3\n",
    }
    write(tmp_path, files)
    swarm, found = load_swarm(tmp_path / "swarm.yaml")
    assert swarm is not None, found
    of_hosts = {name: {one.path for one in bundle.files} for name, bundle in bundles(swarm).items()}
    assert "packages/k3_description/k3.stl" in of_hosts["laptop"]
    assert not [path for path in of_hosts["pi"] if path.startswith("packages/")]
