"""`bin/ros-exec` runs a program in the ROS of a host, the swarm's workspace included."""

from __future__ import annotations

import subprocess
from pathlib import Path

from tests import ROOT

ROS_EXEC = ROOT / "templates/host/ros-exec"
OWN, SYSTEM = "/opt/swarm/s/current/drivers", "/usr/share:/usr/lib"


def environment(workspace: Path | None, *arguments: str) -> dict[str, str]:
    """What a program sees that is run with ``arguments``, in a swarm with this workspace."""
    given = {
        "PATH": "/usr/bin:/bin",
        "ROS_DISTRO": "nowhere",
        "ROS_MASTER_URI": "http://10.0.0.1:11311",
        "ROS_PACKAGE_PATH": f"{OWN}:{SYSTEM}",
    }
    if workspace is not None:
        given["SWARM_WORKSPACE"] = str(workspace)
    argv = ("sh", str(ROS_EXEC), "sh", "-c", "env", "sh", *arguments)
    printed = subprocess.run(argv, env=given, capture_output=True, text=True, check=True).stdout
    return dict(line.split("=", 1) for line in printed.splitlines())


def space(folder: Path) -> Path:
    """A space whose setup.sh does what catkin's does, and records its arguments."""
    folder.mkdir(parents=True)
    (folder / "setup.sh").write_text(
        f"export ROS_PACKAGE_PATH={folder}/share ROS_MASTER_URI=http://localhost:11311 ROS_DISTRO=other\n"
        'export SAW="$*"\necho set up\n'
    )
    return folder


def test_workspace_packages_come_between_swarm_and_system(tmp_path: Path) -> None:
    seen = environment(space(tmp_path / "devel").parent)
    assert seen["ROS_PACKAGE_PATH"] == f"{OWN}:{tmp_path}/devel/share:{SYSTEM}"


def test_master_and_distribution_stay_those_of_the_swarm(tmp_path: Path) -> None:
    seen = environment(space(tmp_path / "devel").parent)
    assert (seen["ROS_MASTER_URI"], seen["ROS_DISTRO"]) == ("http://10.0.0.1:11311", "nowhere")


def test_devel_comes_before_install(tmp_path: Path) -> None:
    install = space(tmp_path / "install")
    assert f"{install}/share" in environment(tmp_path)["ROS_PACKAGE_PATH"]
    assert f"{install}/share" in environment(install)["ROS_PACKAGE_PATH"]
    space(tmp_path / "devel")
    assert f"{tmp_path}/devel/share" in environment(tmp_path)["ROS_PACKAGE_PATH"]


def test_the_setup_file_sees_none_of_the_programs_arguments(tmp_path: Path) -> None:
    """catkin's setup.sh takes `--extend` and `--local` from whoever sources it."""
    assert "--local" not in environment(space(tmp_path / "devel").parent, "--local")["SAW"]


def test_without_any_workspace_the_environment_is_the_units_own() -> None:
    assert environment(None)["ROS_PACKAGE_PATH"] == f"{OWN}:{SYSTEM}"
