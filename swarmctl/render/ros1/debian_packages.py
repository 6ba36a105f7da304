"""Which Debian packages bring what a host needs, the best first."""

from __future__ import annotations

import re

from swarmctl.render.bundle import required

ROSCORE, ROSPY, PYSERIAL, TF = "roscore", "rospy", "pyserial", "tf2_msgs"
PROGRAMS = {  # of Ubuntu 20.04 with the packages of ROS, and of Debian
    ROSCORE: ("ros-noetic-ros-base", "python3-roslaunch"),
    ROSPY: ("ros-noetic-ros-base", "python3-rospy"),
    PYSERIAL: ("python3-serial",),
    TF: ("ros-noetic-tf2-msgs", "python3-tf2-msgs"),
}

_NAME = re.compile(r"[a-z0-9][a-z0-9.+-]+")


def packages(requirement: str) -> tuple[str, ...]:
    """Returns the package of ROS's own archive, then those of Debian."""
    kind, name = required(requirement)
    if kind == "package":
        dashed = name.replace("_", "-")
        return (f"ros-noetic-{dashed}", f"python3-{dashed}", f"ros-{dashed}")
    return PROGRAMS.get(name, ())


def packages_of_key(key: str, *, headers: bool) -> tuple[str, ...]:
    """Returns the package of ROS's own archive, those of Debian, and the one of the same name."""
    dashed = key.replace("_", "-").lower()
    runtime, compiled = (f"python3-{dashed}", f"ros-{dashed}"), (f"lib{dashed}-dev",)
    of_debian = (*compiled, *runtime) if headers else (*runtime, *compiled)
    plain = (dashed,) if "-" in key or key == "catkin" else ()
    return tuple(one for one in (f"ros-noetic-{dashed}", *of_debian, *plain) if _NAME.fullmatch(one))
