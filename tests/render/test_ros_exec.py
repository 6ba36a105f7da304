"""`bin/ros-exec` runs a program in the ROS of a host, the swarm's workspace included."""

from __future__ import annotations

import subprocess
from pathlib import Path

from tests import ROOT

ROS_EXEC = ROOT / "templates/ros1/ros-exec"
OWN, SYSTEM = "/opt/swarm/s/current/drivers", "/usr/share:/usr/lib"


def environment(workspace: Path | None, *arguments: str, own: str = OWN, **variables: str) -> dict[str, str]:
    """What a program sees that is run with ``arguments``, in a swarm with this workspace."""
    given = {
        "PATH": "/usr/bin:/bin",
        "ROS_DISTRO": "nowhere",
        "ROS_MASTER_URI": "http://10.0.0.1:11311",
        "ROS_PACKAGE_PATH": f"{own}:{SYSTEM}" if own else SYSTEM,
        **variables,
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


def test_a_releases_own_packages_come_before_a_workspace(tmp_path: Path) -> None:
    own = f"{OWN}:/opt/swarm/s/current/packages"
    seen = environment(space(tmp_path / "devel").parent, own=own)
    assert seen["ROS_PACKAGE_PATH"] == f"{own}:{tmp_path}/devel/share:{SYSTEM}"


def test_modules_of_a_release_come_before_those_of_a_workspace(tmp_path: Path) -> None:
    devel = space(tmp_path / "devel")
    with (devel / "setup.sh").open("a") as file:
        file.write('export PYTHONPATH="/ws/python${PYTHONPATH:+:$PYTHONPATH}"\n')
    own = f"{OWN}/nav/src"
    assert environment(tmp_path, PYTHONPATH=own)["PYTHONPATH"] == f"{own}:/ws/python"
    assert environment(tmp_path)["PYTHONPATH"] == "/ws/python"


def test_a_release_without_packages_leaves_the_workspace_first(tmp_path: Path) -> None:
    seen = environment(space(tmp_path / "devel").parent, own="")
    assert seen["ROS_PACKAGE_PATH"] == f"{tmp_path}/devel/share:{SYSTEM}"


def test_the_last_of_several_workspaces_extends_the_others(tmp_path: Path) -> None:
    for name in ("lower", "upper"):
        (tmp_path / name / "devel").mkdir(parents=True)
        (tmp_path / name / "devel/setup.sh").write_text(
            f'export ROS_PACKAGE_PATH={tmp_path}/{name}:$ROS_PACKAGE_PATH SAW="$SAW<$*>"\n'
        )
    seen = environment(Path(f"{tmp_path}/lower {tmp_path}/none {tmp_path}/upper"))
    assert seen["ROS_PACKAGE_PATH"].startswith(f"{OWN}:{tmp_path}/upper:{tmp_path}/lower:")
    assert seen["SAW"] == "<><--extend>"


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
