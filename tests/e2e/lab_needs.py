"""What a machine needs for the lab's tests; the reason to skip them where it is missing."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from swarmctl.lab import lab
from swarmctl.lab.hosts import image, processes, ros_wheels
from swarmctl.lab.hosts.workspace import workspace_of
from tests.loading import load_swarm

GIVEN = "SWARMCTL_WORKSPACE"  # built catkin workspaces with what Debian has not, divided by colons


def missing_for_a_lab() -> str:
    """What keeps this machine from running a lab; nothing when it can."""
    try:
        processes.require(
            "ip", "mmdebstrap", "mount", "setpriv", "ssh", "ssh-keygen", "systemd-nspawn", "unshare"
        )
    except lab.LabError as error:
        return f"{error} ({'; '.join(error.help_lines)})"
    return ""


def workspace_with(*packages: str) -> str:
    """The first of the given workspaces that has the packages; without any the test is skipped."""
    for folder in filter(None, os.environ.get(GIVEN, "").split(":")):
        try:
            space = Path(workspace_of(Path(folder), "").space)
        except lab.LabError as error:
            pytest.fail(f"{GIVEN}: {error}")
        if all((space / "share" / name).is_dir() for name in packages):
            return folder
    pytest.skip(f"no {' and no '.join(packages)}: set {GIVEN} to a built catkin workspace that has them")


def skip_without_wheels(spec: Path) -> None:
    """Skips the test if ROS 2 of ``spec`` comes from wheels that this machine cannot have."""
    found, _ = load_swarm(spec)
    assert found is not None
    try:
        for distro in found.distros:
            image.ensure(lambda _line: None, distro=distro)
    except ros_wheels.NoWheelsError as error:
        pytest.skip(f"{error} ({'; '.join(error.help_lines)})")
