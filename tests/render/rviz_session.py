"""RViz on the files of a release, on a screen that nobody sees: ``rviz_session.py IMAGE RELEASE ROBOTS``.

`view.launch` runs in the lab's image with the real robot_state_publisher, RViz is that of this machine, in
the same network. Prints the rows of the displays panel that RViz shows in red, and what RViz reports.
"""

from __future__ import annotations

import json
import os
import shutil
import struct
import subprocess
import sys
import time
import xmlrpc.client
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from tests.onboard.gate.ros_host import ENVIRONMENT, PLACE, URI, RosHost, wait_until
from tests.timing import PATIENCE

SCREEN = "127.0.0.1:7"
#: A lock or a socket in /tmp would outlive the session. Its network has nobody else in it.
NO_FILES = ("-nolock", "-nolisten", "unix", "-nolisten", "local", "-listen", "tcp", "-ac")
PANEL = 340  # pixels, the width of the displays panel
RED = bytes((32, 32, 192))  # blue, green, red of RViz's names of displays with an error
SETTLED = 3.0  # s without a change of what is red
MANIFEST = """<package format="2"><name>rviz</name><version>0.0.0</version><description>waits</description>
<maintainer email="swarmctl@swarmctl.invalid">swarmctl</maintainer><license>Apache-2.0</license></package>
"""


def red_rows(screen: Path) -> int:
    """Returns how many rows of the panel have red letters, in a screen that Xvfb keeps as an XWD file."""
    content = screen.read_bytes()
    header = struct.unpack(">25I", content[:100])
    start, height, line = header[0] + 12 * header[19], header[5], header[12]
    rows, last = 0, -10
    for y in range(height):
        if RED in content[start + y * line : start + y * line + 4 * PANEL]:
            rows += y - last > 4
            last = y
    return rows


def expanded(displays: Mapping[str, Any]) -> str:
    """Returns a display file with all groups open and a panel that is high enough for them."""
    groups = [one["Name"] for one in displays["Visualization Manager"]["Displays"] if "Displays" in one]
    tree = {"Expanded": [f"/{name}1" for name in groups], "Splitter Ratio": 0.5}
    panel = {"Class": "rviz/Displays", "Name": "Displays", "Tree Height": 900, "Property Tree Widget": tree}
    return yaml.safe_dump({**displays, "Panels": [panel], "Window Geometry": {"Width": 1200, "Height": 1300}})


def look(displays: Mapping[str, Any], environment: Mapping[str, str], red: int) -> dict[str, Any]:
    """Shows a display file; returns its topics, its red rows and RViz's report.

    RViz shows a row in red some time after it began: the rows change no more then, and are as many as ``red``
    unless they do not become so.
    """
    file, log = PLACE / "shown.rviz", PLACE / "rviz.log"
    file.write_text(expanded(displays))
    with log.open("w") as output:
        rviz = subprocess.Popen(
            ("rviz", "-d", str(file)), env=environment, stdout=output, stderr=subprocess.STDOUT
        )
    topics = {
        one["Topic"]
        for group in displays["Visualization Manager"]["Displays"]
        for one in group.get("Displays", ())
        if "Topic" in one
    }
    wait_until(lambda: topics <= subscribed(), f"RViz subscribes to {topics}, {log.read_text()}")
    screen, seen, began = PLACE / "Xvfb_screen0", -1, time.monotonic()
    since = began
    while time.monotonic() - since < SETTLED or (seen != red and time.monotonic() - began < PATIENCE):
        if (now := red_rows(screen)) != seen:
            seen, since = now, time.monotonic()
        time.sleep(0.1)
    assert rviz.poll() is None, log.read_text()
    rviz.terminate()
    rviz.wait(10)
    reports = [line for line in log.read_text().splitlines() if "WARN" in line or "ERROR" in line]
    return {"red": seen, "topics": sorted(topics), "log": reports}


def subscribed() -> set[str]:
    """The topics to which an RViz subscribes."""
    _, _, (_, subscribers, _) = xmlrpc.client.ServerProxy(URI).getSystemState("/test")
    return {topic for topic, nodes in subscribers if any(one.startswith("/rviz") for one in nodes)}


def waiting_rviz(root: Path) -> None:
    """Puts a package `rviz` into the image whose program only waits."""
    folder = root / "stand-in/rviz"
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(MANIFEST)
    (folder / "rviz").write_text("#!/bin/sh\nexec sleep 300\n")
    (folder / "rviz").chmod(0o755)


def main(image: Path, release: Path, robots: str) -> dict[str, Any]:
    host = RosHost(image, {}, Path(__file__).parent / "rviz_nodes")
    shutil.copytree(release, host.root / "release")
    (host.root / "etc/hosts").write_text("127.0.0.1 localhost\n")
    (host.root / "robots.json").write_text(robots)
    waiting_rviz(host.root)
    drivers = host.node("robots.py", "/robots.json")
    wait_until(lambda: drivers.lines, "the drivers publish")
    launch = ("roslaunch", "/release/launch/view.launch")
    with (host.root / "launch.log").open("w") as output:
        subprocess.Popen(
            ("chroot", str(host.root), *launch),
            env={**ENVIRONMENT, "ROS_PACKAGE_PATH": "/stand-in:/usr/share"},
            stdout=output, stderr=subprocess.STDOUT,
        )  # fmt: skip
    subprocess.Popen(
        ("Xvfb", ":7", "-screen", "0", "1280x1400x24", "-fbdir", str(PLACE), *NO_FILES),
        stderr=subprocess.DEVNULL,
    )
    wait_until((PLACE / "Xvfb_screen0").exists, "Xvfb starts")
    home = PLACE / "home"
    home.mkdir(mode=0o700)
    environment = {
        **os.environ, "ROS_MASTER_URI": URI, "ROS_IP": "127.0.0.1", "HOME": str(home), "DISPLAY": SCREEN,
        "XDG_RUNTIME_DIR": str(home), "ROS_PACKAGE_PATH": "/usr/share", "LIBGL_ALWAYS_SOFTWARE": "1",
    }  # fmt: skip
    displays = yaml.safe_load((release / "rviz/swarm.rviz").read_text())
    right = look(displays, environment, 0)
    first = next(one for one in displays["Visualization Manager"]["Displays"] if "Displays" in one)
    first["Displays"][0]["Robot Description"] = "/nobody/robot_description"
    first["Displays"].append({"Class": "rviz/NoSuchDisplay", "Name": "unknown", "Enabled": True})
    return {"right": right, "wrong": look(displays, environment, 2)}


if __name__ == "__main__":
    print(json.dumps(main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3])))
