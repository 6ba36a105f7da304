"""`ros-exec`, `run-node` and `has-packages` of ROS 2, with setup files as ROS has them."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from swarmctl.render.ros2.graph_environment import GRAPH_VARIABLES
from swarmctl.resources import templates

SCRIPTS = templates() / "ros2"
SHELLS = ("dash", "bash")


def space(folder: Path, name: str = "setup.sh") -> Path:
    """A space whose setup file exports what those of ROS do, and records its arguments."""
    folder.mkdir(parents=True)
    (folder / name).write_text(
        f'export AMENT_PREFIX_PATH="{folder}${{AMENT_PREFIX_PATH:+:$AMENT_PREFIX_PATH}}" SAW="$SAW$*"\n'
        'export ROS_DISTRO=other ROS_LOCALHOST_ONLY=0 ROS_DOMAIN_ID=0 AT="$COLCON_CURRENT_PREFIX"\n'
        "echo set up\n"
    )
    return folder


def run(shell: str, script: str, *arguments: str, **variables: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        (shell, str(SCRIPTS / script), *arguments),
        env={"PATH": "/usr/bin:/bin", **variables},
        capture_output=True, text=True, check=False,
    )  # fmt: skip


def seen(shell: str, **variables: str) -> dict[str, str]:
    """The variables of a program that `ros-exec` runs."""
    printed = run(shell, "ros-exec", "env", **variables).stdout
    return dict(line.split("=", 1) for line in printed.splitlines())


def executable(prefix: Path, package: str, text: str, mode: int = 0o755) -> None:
    file = prefix / "lib" / package / "node"
    file.parent.mkdir(parents=True)
    file.write_text(text)
    file.chmod(mode)


@pytest.mark.parametrize("shell", SHELLS)
def test_the_release_decides_how_nodes_find_each_other(shell: str, tmp_path: Path) -> None:
    """A setup file of Humble exports ROS_LOCALHOST_ONLY=0, and a user's own anything."""
    space(tmp_path / "install")
    own = {"ROS_DISTRO": "nowhere", "ROS_DOMAIN_ID": "7", "ROS_STATIC_PEERS": "10.0.0.1;10.0.0.2 $x"}
    found = seen(shell, SWARM_WORKSPACE=str(tmp_path), **own)
    assert {key: found[key] for key in own} == own
    assert "ROS_LOCALHOST_ONLY" not in found
    assert (found["SAW"], found["AT"]) == ("", str(tmp_path / "install"))
    assert "COLCON_CURRENT_PREFIX" not in found


@pytest.mark.parametrize("shell", SHELLS)
def test_the_last_workspace_comes_first(shell: str, tmp_path: Path) -> None:
    one, two = space(tmp_path / "one/install"), space(tmp_path / "two")
    found = seen(
        shell, ROS_DISTRO="nowhere", SWARM_WORKSPACE=f"{tmp_path}/one {tmp_path}/two {tmp_path}/none"
    )
    assert found["AMENT_PREFIX_PATH"] == f"{two}:{one}"


def test_no_variable_is_forgotten() -> None:
    text = (SCRIPTS / "ros-exec").read_text("utf-8")
    assert [name for name in GRAPH_VARIABLES if name not in text] == []


@pytest.mark.parametrize("shell", SHELLS)
def test_a_node_takes_the_place_of_run_node(shell: str, tmp_path: Path) -> None:
    executable(tmp_path / "a", "moves", "#!/bin/sh\necho no\n", mode=0o644)
    executable(tmp_path / "b", "moves", '#!/bin/sh\nprintf "%s|" "$@"\n')
    prefixes = f"{tmp_path}/a:{tmp_path}/b"
    ran = run(shell, "run-node", "moves", "node", "a b", "*", AMENT_PREFIX_PATH=prefixes)
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, "a b|*|", "")


@pytest.mark.parametrize("shell", SHELLS)
@pytest.mark.parametrize(
    ("prefixes", "looked"),
    [("/x:/y", "/x/lib/moves /y/lib/moves"), ("", "nothing, AMENT_PREFIX_PATH is empty")],
)
def test_a_missing_node_is_named_with_the_places(shell: str, prefixes: str, looked: str) -> None:
    ran = run(shell, "run-node", "moves", "node", AMENT_PREFIX_PATH=prefixes)
    assert (ran.returncode, ran.stderr) == (
        127,
        f"package moves has no executable node; looked in: {looked}\n",
    )


@pytest.mark.parametrize("shell", SHELLS)
def test_missing_packages_are_named(shell: str, tmp_path: Path) -> None:
    index = tmp_path / "share/ament_index/resource_index/packages"
    index.mkdir(parents=True)
    (index / "joy").touch()
    assert run(shell, "has-packages", "joy", AMENT_PREFIX_PATH=f"/x:{tmp_path}").returncode == 0
    ran = run(shell, "has-packages", "slam", "joy", "nav", AMENT_PREFIX_PATH=f"/x:{tmp_path}")
    assert (ran.returncode, ran.stderr) == (1, "this host lacks the ROS packages slam, nav\n")
