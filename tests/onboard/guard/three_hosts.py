"""Three hosts with real ROS and the guard before the master of one: ``three_hosts.py IMAGE``. Prints JSON.

Each host is a network namespace; a bridge joins them.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from tests.onboard.gate.ros_host import ENVIRONMENT, Node, RosHost, wait_until
from tests.onboard.guard.facts import EPUCK, K3, LAPTOP, parameters
from tests.timing import PATIENCE

PORT = 11311
CALL = "import json, sys, xmlrpc.client as x; uri, name, *given = json.loads(sys.argv[1])\n"
CALL += "print(json.dumps(getattr(x.ServerProxy(uri), name)(*given)))"


def real(text: str) -> str:
    """The same with the addresses of the bridge in place of loopback ones."""
    return text.replace("127.0.0.", "10.9.0.")


URI = real(f"http://{LAPTOP}:{PORT}")


class Hosts(RosHost):
    """The three; this process is on the laptop."""

    def __init__(self, image: Path) -> None:
        _ip("link", "add", "bridge", "type", "bridge")
        _ip("addr", "add", f"{real(LAPTOP)}/24", "dev", "bridge")
        _ip("link", "set", "bridge", "up")
        self._inside_of = {real(address): _host(real(address)) for address in (K3, EPUCK)}
        data = {**json.loads(real(json.dumps(parameters(PORT)))), "places": [real(LAPTOP), "127.0.0.1"]}
        super().__init__(image, data, HERE / "nodes", "guard")

    def start_master(self) -> None:
        """Starts the master behind its guard, as the unit does."""
        (self.root / "tmp/log").mkdir()
        (self.root / "etc/hosts").write_text("127.0.0.1 localhost\n")  # roslaunch ends without
        argv = ("python3", "/guard/guarded_master.py", "--config", "/params.yaml")
        self.journal = (self.root / "journal").open("w+")
        self.guard = subprocess.Popen(
            self._inside(*argv), env=self._environment(LAPTOP), stdout=subprocess.DEVNULL, stderr=self.journal
        )
        wait_until(lambda: self.call(K3, "lookupNode", "/test", "/rosout")[0] == 1, "rosout registers")

    def call(self, address: str, method: str, *arguments: Any) -> Any:
        """The guard's answer to a call from the host at ``address``; [0] for none."""
        argv = (*self._at(address), sys.executable, "-c", CALL, json.dumps([URI, method, *arguments]))
        done = subprocess.run(argv, capture_output=True, text=True, check=False, timeout=PATIENCE)
        return json.loads(done.stdout) if done.returncode == 0 else [0]

    def start(self, address: str, *argv: str) -> Node:
        """Starts a program on the host at ``address``."""
        return Node((*self._at(address), *self._inside(*argv)), self._environment(address))

    def script(self, address: str, script: str, *arguments: str) -> Node:
        return self.start(address, "python3", f"/nodes/{script}", *arguments)

    def _at(self, address: str) -> Sequence[str]:
        process = self._inside_of.get(real(address))
        return () if process is None else ("nsenter", f"--net=/proc/{process}/ns/net")

    def _environment(self, address: str) -> dict[str, str]:
        return {**ENVIRONMENT, "ROS_MASTER_URI": URI, "ROS_IP": real(address), "ROS_DISTRO": "noetic"}


HERE = Path(__file__).parent


def _ip(*argv: str) -> None:
    subprocess.run(("ip", *argv), check=True)


def _host(address: str) -> int:
    """Returns a process in the network namespace of a new host at ``address``."""
    process = subprocess.Popen(("unshare", "--net", "sleep", "1000")).pid
    wait_until(lambda: _net(process) != _net("self"), "the namespace is there")
    name = f"host{address.rpartition('.')[2]}"
    _ip("link", "add", name, "type", "veth", "peer", "name", "eth0", "netns", str(process))
    _ip("link", "set", name, "master", "bridge", "up")
    inside = ("nsenter", f"--net=/proc/{process}/ns/net", "ip")
    subprocess.run((*inside, "addr", "add", f"{address}/24", "dev", "eth0"), check=True)
    for one in ("lo", "eth0"):
        subprocess.run((*inside, "link", "set", one, "up"), check=True)
    return process


def _net(process: object) -> str:
    return str(Path(f"/proc/{process}/ns/net").readlink())


def _listening() -> Iterator[str]:
    """The addresses of the laptop where something listens on the port of the master."""
    for line in Path("/proc/net/tcp").read_text().splitlines()[1:]:
        place, state = line.split()[1], line.split()[3]
        if state == "0A" and int(place.split(":")[1], 16) == PORT:
            yield ".".join(str(one) for one in reversed(bytes.fromhex(place.split(":")[0])))


def received(node: Node) -> list[str]:
    return [line["received"] for line in list(node.lines)]


def main() -> None:
    hosts = Hosts(Path(sys.argv[1]))
    found: dict[str, Any] = {"listens": sorted(_listening())}
    on_laptop = hosts.script(LAPTOP, "listener.py", "/rviz", "/k3/odom")
    on_epuck = hosts.script(EPUCK, "listener.py", "/logger", "/k3/odom")
    hosts.script(K3, "talker.py", "/k3/driver", "/k3/odom")
    wait_until(lambda: received(on_laptop) and received(on_epuck), "messages arrive")
    found["run_id"] = hosts.call(K3, "getParam", "/x", "/run_id")[0]

    imposter = hosts.script(EPUCK, "talker.py", "/imposter", "/k3/odom")
    hosts.start(K3, "roslaunch", "--wait", "/nodes/own.launch")
    wait_until(lambda: hosts.call(K3, "lookupNode", "/x", "/k3/roscpp")[0] == 1, "roslaunch starts a node")
    found["roslaunch"] = hosts.call(K3, "getParam", "/x", "/k3/rate")
    wait_until(lambda: "/imposter" in (hosts.root / "journal").read_text(), "the imposter is refused")
    taken = real(f"http://{EPUCK}:1/")
    found["refused"] = {
        "name": hosts.call(EPUCK, "registerPublisher", "/k3/driver", "/x", "std_msgs/String", taken)[0],
        "run_id": hosts.call(K3, "setParam", "/x", "/run_id", "mine")[0],
        "shutdown": hosts.call(K3, "shutdown", "/x", "bye")[0],
    }
    count = len(received(on_epuck))
    wait_until(lambda: len(received(on_epuck)) > count + 5, "messages still arrive")
    found["received"] = sorted({*received(on_laptop), *received(on_epuck)})
    imposter.kill()
    data = json.loads((hosts.root / "params.yaml").read_text())
    (hosts.root / "params.yaml").write_text(
        json.dumps({**data, "names": {**data["names"], "/new": ["k3-pi"]}})
    )
    wait_until(
        lambda: hosts.call(EPUCK, "setParam", "/x", "/new/rate", 1)[0] == -1, "it reads what has changed"
    )
    found["after"] = hosts.call(K3, "lookupNode", "/x", "/k3/driver")[0]
    rosout = hosts.call(K3, "lookupNode", "/x", "/rosout")[2]
    subprocess.run(("pkill", "-KILL", "-x", "rosout"), check=True)
    wait_until(lambda: hosts.call(K3, "lookupNode", "/x", "/rosout")[2] != rosout, "rosout starts again")
    found["parameters"] = [hosts.call(K3, "getParam", "/x", one)[2] for one in ("/rosdistro", "/rosversion")]
    hosts.guard.terminate()
    found["exit status"] = hosts.guard.wait(PATIENCE)
    found["rosout ends"] = subprocess.run(("pgrep", "-x", "rosout"), check=False).returncode == 1
    found["journal"] = (hosts.root / "journal").read_text().splitlines()
    print(json.dumps(found))


if __name__ == "__main__":
    main()
