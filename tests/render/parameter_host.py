"""A host whose ROS reads parameter files: ``parameter_host.py IMAGE [DISTRO]``, with a distro that of ROS 2.

A text in JSON comes in on each line, what a node gets goes out. Runs in namespaces of its own.
"""

from __future__ import annotations

import os
import socket
import sys
from pathlib import Path

from tests.onboard.gate.ros_host import ENVIRONMENT, PLACE, RosHost, mounted

READERS = Path(__file__).with_name("parameter_readers")


def main() -> None:
    image, distro = Path(sys.argv[1]), sys.argv[2]
    root = mounted(image, PLACE, READERS, "gate") if distro else RosHost(image, {}, READERS).root
    (root / "etc/hosts").write_text(f"127.0.0.1 localhost {socket.gethostname()}\n")
    prefix, script = f"/opt/ros/{distro}", "rcl_reader.py" if distro else "rosparam_reader.py"
    of_ros2 = {
        "AMENT_PREFIX_PATH": prefix,
        "LD_LIBRARY_PATH": f"{prefix}/lib",
        "PYTHONPATH": f"{prefix}/lib/python3.11/site-packages",
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF",
    }
    environment = {**ENVIRONMENT, "ROS_PACKAGE_PATH": "/packages", **(of_ros2 if distro else {})}
    os.execvpe("chroot", ("chroot", str(root), "python3", f"/nodes/{script}"), environment)


if __name__ == "__main__":
    main()
