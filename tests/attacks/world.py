"""What is true of the swarm, observed from outside the attacker: the emulator's wheels, root on its hosts."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from swarmctl.swarm.ports import USUAL_MASTER
from tests.e2e.lab_swarm import HOME, LEADER, SWARM, LabSwarm, SshError, quoted
from tests.e2e.ros_addresses import ros_addresses
from tests.timing import wait_for

HOST = "k3-pi"  # with the robot that is attacked
ROBOT = "k3"
PROOF = "/tmp/intruder-was-here"
#: Prints what the master and the driver answer to root on the master's host.
_WITNESS = """
import json, socket, xmlrpc.client
socket.setdefaulttimeout(10)
master = xmlrpc.client.ServerProxy("MASTER")
publishers, subscribers, _ = master.getSystemState("/witness")[2]
parameters = master.getParam("/witness", "/")[2]
driver = master.lookupNode("/witness", "/k3/driver")[2]
commanders = [node for topic, nodes in publishers if topic == "/k3/cmd_vel" for node in nodes
              if node.startswith("/rostopic")]
print(json.dumps({
    "pid": master.getPid("/witness")[2],
    "publishers": sorted((topic, node) for topic, nodes in publishers for node in nodes),
    "subscribers": sorted((topic, node) for topic, nodes in subscribers for node in nodes),
    "driver": driver,
    "squatted": master.lookupNode("/witness", "/koala/driver")[2],
    "parameters": [parameters.get("run_id"), parameters.get("k3")],
    "commanders": [(node, master.lookupNode("/witness", node)[2]) for node in commanders],
}))
"""
_TOPICS = """
import socket, xmlrpc.client
socket.setdefaulttimeout(10)
print(xmlrpc.client.ServerProxy("DRIVER").requestTopic("/witness", "/k3/odom", [["TCPROS"]])[2][2])
"""
_ANSWERS = """
import socket, xmlrpc.client
socket.setdefaulttimeout(3)
xmlrpc.client.ServerProxy("MASTER").getPid("/witness")
"""
#: Has the master forget the commanders that were killed. rospy calls each publisher that the master lists: a
#: call to the port of a dead one, which the topics of a new one have by now, keeps those busy for a minute.
_FORGET = """
import xmlrpc.client
master = xmlrpc.client.ServerProxy("MASTER")
for topic, nodes in master.getSystemState("/witness")[2][0]:
    for node in nodes:
        if node.startswith("/rostopic"):
            master.unregisterPublisher(node, topic, master.lookupNode("/witness", node)[2])
"""
#: Of nodes that come and go, and of the host that is cut off while another one has its address.
_PASSING = ("/rostopic", "/epuck/")
_LASTING = {(f"/{robot}/cmd_vel", f"/{robot}/driver") for robot in ("k3", "koala")}


@dataclass(frozen=True)
class World:
    """``graph``: what the witness prints; ``pids``: of the units; ``robot``: its true state."""

    graph: Mapping[str, Any]
    pids: Mapping[str, int]
    robot: Mapping[str, Any]

    @property
    def sound(self) -> tuple[Any, ...]:
        """What an attack may not have changed when the next one begins."""
        lists = (self.graph["publishers"], self.graph["subscribers"])
        lasting = [[one for one in entries if not one[1].startswith(_PASSING)] for entries in lists]
        return *lasting, self.graph["driver"], self.graph["parameters"], self.graph["pid"], self.pids

    def publishes(self, topic: str, node: str) -> bool:
        return [topic, node] in self.graph["publishers"]


class Observer:
    """Looks at a lab's swarm as root on its hosts, and puts it right."""

    def __init__(self, swarm: LabSwarm) -> None:
        self.swarm = swarm
        self.master = f"http://{ros_addresses(swarm)[LEADER]}:{USUAL_MASTER}/"

    def look(self) -> World:
        """Waits for a master that answers: it may have been restarted just now."""
        found = wait_for(self._look, complaint="the master does not answer")
        assert found is not None
        return found

    def _look(self) -> World | None:
        with suppress(SshError):
            graph = json.loads(self._python(LEADER, _WITNESS.replace("MASTER", self.master)))
            pids = {
                f"{host}:{name}": unit.pid
                for host in (HOST, LEADER)
                for name, unit in self.swarm.units(host).items()
            }
            return World(graph, pids, self.swarm.robot(ROBOT))
        return None

    def _python(self, host: str, program: str) -> str:
        return self.swarm.shell(host, f"sudo python3 -c {quoted(program)}", timeout=60)

    def topics(self, world: World) -> int:
        """The port of the driver's topics."""
        return int(self._python(LEADER, _TOPICS.replace("DRIVER", world.graph["driver"])))

    def master_answers(self) -> bool:
        """Whether the master answers a declared host within 3 s."""
        try:
            self._python(HOST, _ANSWERS.replace("MASTER", self.master))
        except SshError:
            return False
        return True

    def place(self) -> tuple[float, float]:
        """x and y (m) of the robot's odometry, as its commander reads it."""
        pose = self.swarm.odometry(LEADER, ROBOT)
        return pose.x, pose.y

    def lock_is_free(self, host: str) -> bool:
        try:
            self.swarm.shell(host, f"sudo flock -n {HOME}/state/lock true")
        except SshError:
            return False
        return True

    def files(self, host: str) -> str:
        """A digest of the names, owners and contents of all that swarmctl has on a host."""
        names = r"find . -printf '%p %u %m %l\n' | sort"
        contents = "find . -type f -print0 | sort -z | xargs -0 sha256sum"
        listed = self.swarm.shell(host, f"sudo bash -c {quoted(f'cd {HOME}; {names}; {contents}')}")
        return hashlib.sha256(listed.encode()).hexdigest()

    def logged_in(self) -> bool:
        """Whether somebody left the proof of a login, which is removed."""
        found = self.swarm.shell(HOST, f"ls {PROOF} 2>/dev/null; sudo rm -f {PROOF}")
        return bool(found.strip())

    def restored(self, wanted: World) -> World:
        """The swarm as it was; its units are restarted if an attack has changed what lasts."""
        if self.look().sound == wanted.sound:
            self._python(LEADER, _FORGET.replace("MASTER", self.master))
            return wanted
        prefix = f"swarm-{SWARM}."
        self.swarm.shell(LEADER, f"sudo systemctl restart {prefix}master")
        for host, names in ((LEADER, f"{prefix}koala"), (HOST, f"{prefix}k3")):
            self.swarm.shell(host, f"sudo systemctl reset-failed; sudo systemctl restart {names}")
        return self.whole()

    def whole(self) -> World:
        """Waits until the drivers have registered all that they have, and nothing changes any more."""
        before: World | None = None

        def settled() -> World | None:
            nonlocal before
            last, before = before, self.look()
            there = {tuple(one) for one in before.graph["subscribers"]} >= _LASTING
            complete = there and before.graph["driver"] and all(before.graph["parameters"])
            return before if complete and last is not None and last.sound == before.sound else None

        found = wait_for(settled, complaint="the drivers do not register", interval=0.2)
        assert found is not None
        return found
