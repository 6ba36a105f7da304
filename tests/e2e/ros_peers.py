"""What ROS's own tools report of a deployed swarm: roswtf on its hosts, the frames that RViz would get."""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from tests.e2e.lab_swarm import SOURCE, LabSwarm, quoted

#: What roswtf reports on every host, and why that is not a fault of the swarm.
OF_THE_IMAGE = {
    "ROS_ROOT [/usr/share/ros] does not point to a directory": "Debian's ros-environment sets it",
    "ROS Dep database not updated": "rosdep installs what a host lacks; nothing here uses it",
    "You are missing core ROS Python modules: rosdep2": "the same",
}
UNCONNECTED = "The following node subscriptions are unconnected"
#: A node is seen by one master, and connected with nodes of others that the multimaster has introduced.
MISSING = "The following nodes should be connected but aren't"
UNEXPECTED = "The following nodes are unexpectedly connected"
_BRIDGE = re.compile(r"Node \[/multimaster_\w+\] is not connected to anything")  # nodes connect to each other
NOWHERE: Mapping[str, Collection[str]] = {}
#: Topics that wait for a publisher that need not be there: commands, lights, sounds, a gamepad.
WAITING = {
    "cmd_vel", "leds", "body_light", "front_light", "colours", "sound", "joy",
}  # fmt: skip
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")
_FINDING = re.compile(r"^(?:ERROR|WARNING) (.+?)\n(?=\n|ERROR|WARNING|====|\Z)", re.MULTILINE | re.DOTALL)

# In place of RViz in `view.launch`: writes down for some seconds what RViz would get.
LISTENER = """\
#!/usr/bin/env python3
import json, sys, time
import rospy
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage

parents, joints = {}, {}

def frames(message):
    for one in message.transforms:
        parents.setdefault(one.child_frame_id, set()).add(one.header.frame_id)

def wheels(message, robot):
    joints[robot] = list(message.name)

rospy.init_node("rviz")
for topic in ("/tf", "/tf_static"):
    rospy.Subscriber(topic, TFMessage, frames, queue_size=1000)
described = [name for name in rospy.get_param_names() if name.endswith("/robot_description")]
robots = [name.rpartition("/")[0] for name in described]
for robot in robots:
    rospy.Subscriber(robot + "/joint_states", JointState, wheels, robot, queue_size=10)
until, known = time.monotonic() + 20.0, -1
while known < len(parents) + len(joints) and time.monotonic() < until:  # until two seconds bring nothing new
    known = len(parents) + len(joints)
    time.sleep(4.0 if known == 0 else 2.0)
with open("/tmp/seen.json", "w") as file:
    json.dump({
        "parents": {child: sorted(found) for child, found in parents.items()},
        "joints": joints, "arguments": sys.argv[1:],
    }, file)
"""
MANIFEST = """\
<package format="2"><name>rviz</name><version>0.0.0</version><description>in place of RViz</description>
<maintainer email="swarmctl@swarmctl.invalid">swarmctl</maintainer><license>Apache-2.0</license></package>
"""


@dataclass(frozen=True)
class Seen:
    """What RViz would get: the parents of every frame, the joints of every robot, its own command line."""

    parents: Mapping[str, Sequence[str]]
    joints: Mapping[str, Sequence[str]]
    arguments: Sequence[str]

    def root_of(self, frame: str) -> str:
        """The frame at the top of the tree of ``frame``."""
        while frame in self.parents:
            frame = self.parents[frame][0]
        return frame


def roswtf(
    swarm: LabSwarm,
    release: str,
    hosts: Sequence[str] = (),
    elsewhere: Mapping[str, Collection[str]] = NOWHERE,
) -> dict[str, list[str]]:
    """By host, what roswtf reports that is a fault of the swarm; hosts without any are left out.

    ``release`` is the folder of the release on each host, ``elsewhere`` by host the nodes of other masters.
    One host after the other: a roswtf is a node itself, and the next one would miss it once it has ended.
    """
    found = {
        host: list(_faults(swarm, host, release, elsewhere.get(host, ()))) for host in hosts or swarm.hosts
    }
    return {host: faults for host, faults in found.items() if faults}


def unregister_killed(swarm: LabSwarm, host: str) -> None:
    """Removes the nodes that tests killed from the master of ``host``; none of a robot may be dead."""
    output = swarm.shell(host, f"{SOURCE}; yes | timeout 60 rosnode cleanup 2>&1 || true", timeout=90)
    dead = re.findall(r"^ \* (/\S+)$", output, re.MULTILINE)
    assert not {node.split("/")[1] for node in dead} & swarm.robots().keys(), output


def _faults(swarm: LabSwarm, host: str, release: str, elsewhere: Collection[str]) -> Iterator[str]:
    command = f"source {release}/setup.bash; cd /; timeout 60 roswtf 2>&1 || echo 'ERROR it failed'"
    text = _COLOUR.sub("", swarm.shell(host, command, timeout=90))
    if "Traceback" in text or "Online checks summary" not in text:
        yield text
    for finding in _FINDING.findall(text + "\n"):
        if finding.startswith(UNCONNECTED):
            topics = re.findall(r"^ +\* (/\S+[^:\s])$", finding, re.MULTILINE)
            yield from (f"nobody publishes {one}" for one in topics if not _may_wait(one))
        elif elsewhere and finding.startswith(MISSING):
            edges = re.findall(r"^ +\* (\S+)->(\S+) ", finding, re.MULTILINE)
            yield from (f"{ends} are not connected" for ends in edges if not _bridged(ends))
        elif finding.startswith(UNEXPECTED):
            edges = re.findall(r"^ +\* (\S+)->(\S+) ", finding, re.MULTILINE)
            yield from (f"{ends} are connected" for ends in edges if not set(ends) & set(elsewhere))
        elif not finding.startswith(tuple(OF_THE_IMAGE)) and not (elsewhere and _BRIDGE.match(finding)):
            yield finding


def _bridged(ends: tuple[str, str]) -> bool:
    """True for a topic that the multimaster registers: nodes connect to the one that it stands for."""
    return any(one.startswith("/multimaster_") for one in ends)


def _may_wait(topic: str) -> bool:
    space, _, name = topic.rpartition("/")
    return name in WAITING and not space.endswith("/gate")  # a driver's commands come from its gate


def view(swarm: LabSwarm, host: str, release: str) -> Seen:
    """Runs the swarm's `view.launch` on ``host``, with the real robot_state_publisher and no RViz."""
    swarm.shell(
        host,
        "rm -rf /tmp/view /tmp/seen.json; mkdir -p /tmp/view/rviz; cd /tmp/view/rviz; "
        f"printf %s {quoted(MANIFEST)} > package.xml; printf %s {quoted(LISTENER)} > rviz; chmod +x rviz",
    )
    swarm.shell(
        host,
        f"source {release}/setup.bash; export ROS_PACKAGE_PATH=/tmp/view:$ROS_PACKAGE_PATH; "
        f"roslaunch {release}/launch/view.launch >/tmp/view/log 2>&1 || true",
        timeout=90,
    )
    seen = json.loads(swarm.shell(host, "cat /tmp/seen.json || cat /tmp/view/log >&2"))
    swarm.shell(host, "rm -rf /tmp/view /tmp/seen.json")
    return Seen(**seen)
