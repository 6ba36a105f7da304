"""A host with real ROS and no systemd: a rosmaster and rospy nodes in the lab's image.

Runs in namespaces of its own (``run_isolated``): when it ends, everything is gone.
"""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import threading
import time
import xmlrpc.client
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from swarmctl.lab.hosts import processes
from swarmctl.resources import onboard
from tests.timing import PATIENCE

#: An empty folder on every machine; a tmpfs is mounted over it.
PLACE = Path("/mnt")
URI = "http://127.0.0.1:11311"
ENVIRONMENT = {
    "PATH": processes.SEARCH_PATH,
    "LC_ALL": "C.UTF-8",
    "HOME": "/tmp",
    "ROS_LOG_DIR": "/tmp/log",
    "ROS_MASTER_URI": URI,
    "ROS_IP": "127.0.0.1",
    "PYTHONUNBUFFERED": "1",
    "PYTHONDONTWRITEBYTECODE": "1",
}
_TRIES = 200


def run_isolated(script: Path, *arguments: object) -> Any:
    """Returns what ``script`` prints last, from JSON; it runs in namespaces of its own."""
    argv = (sys.executable, str(script), *map(str, arguments))
    done = subprocess.run(
        ("unshare", "--net", *processes.isolated(argv)),
        env=processes.environment(), capture_output=True, text=True, check=False, timeout=10 * PATIENCE,
    )  # fmt: skip
    if done.returncode != 0:
        raise RuntimeError(done.stderr[-4000:])
    return json.loads(done.stdout.splitlines()[-1])


class Node:
    """A process of the host that prints JSON, a value a line. ``lines`` are those so far."""

    def __init__(self, argv: Sequence[str], environment: Mapping[str, str]) -> None:
        self.lines: list[Any] = []
        self.process = subprocess.Popen(
            argv, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line.startswith("{"):  # rospy prints sentences
                self.lines.append(json.loads(line))

    def write(self, value: Any) -> None:
        """Sends it a line of JSON."""
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(value) + "\n")
        self.process.stdin.flush()

    def end(self) -> None:
        """Ends its input, and waits until it has ended."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait()

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()


def mounted(image: Path, place: Path, nodes: Path, folder: str) -> Path:
    """Returns the root of a host below ``place``: ``image``, ``nodes`` and a shipped ``folder``."""
    root = place / "root"
    _run("mount", "-t", "tmpfs", "ros-host", str(place))
    for name in ("root", "upper", "work"):
        (place / name).mkdir()
    layers = f"lowerdir={image},upperdir={place / 'upper'},workdir={place / 'work'}"
    _run("mount", "-t", "overlay", "ros-host", "-o", layers, str(root))
    _run("mount", "-t", "proc", "proc", str(root / "proc"))
    _run("mount", "--rbind", "/dev", str(root / "dev"))
    (root / folder).mkdir()
    _run("cp", "-rT", str(onboard() / "nodes" / folder), str(root / folder))
    _run("cp", "-r", str(onboard()), str(root / folder))
    _run("cp", "-rT", str(nodes), str(root / "nodes"))
    return root


class RosHost:
    """The host: what is tested in ``/gate`` or another ``folder`` of the shipped ones, its parameters in
    ``/params.yaml``, the tests' nodes in ``/nodes``.

    ``image`` is not written to.
    """

    def __init__(self, image: Path, parameters: Mapping[str, Any], nodes: Path, folder: str = "gate") -> None:
        self.root = mounted(image, PLACE, nodes, folder)
        _run("ip", "link", "set", "lo", "up")
        (self.root / "params.yaml").write_text(json.dumps(parameters))
        self.start_master()

    def start_master(self) -> None:
        """Starts a master; returns when it answers."""
        self.master = subprocess.Popen(
            self._inside("rosmaster", "--core", "-p", "11311"),
            env=ENVIRONMENT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        probe = f"import xmlrpc.client as x; x.ServerProxy('{URI}').getPid('/probe')"
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        for _ in range(_TRIES):
            if subprocess.run([sys.executable, "-c", probe], check=False, **quiet).returncode == 0:  # type: ignore[call-overload]
                return
            time.sleep(0.05)
        raise RuntimeError("the master does not start")

    def unregister_killed(self) -> None:
        """Has the master forget the nodes that were killed, as `rosnode cleanup` does.

        rospy calls each publisher that the master lists. The port of a dead one may be that on which a new
        one publishes: it takes the call for a subscriber's, waits for the rest, and serves nobody else.
        """
        master: Any = xmlrpc.client.ServerProxy(URI)
        published, subscribed, served = master.getSystemState("/test")[2]
        for unregister, side in (
            (master.unregisterPublisher, published),
            (master.unregisterSubscriber, subscribed),
            (master.unregisterService, served),
        ):
            for name, node in ((name, node) for name, nodes in side for node in nodes):
                uri = master.lookupNode("/test", node)[2]
                with socket.socket() as probe:
                    if probe.connect_ex(("127.0.0.1", urlsplit(uri).port)):
                        place = uri if side is not served else master.lookupService("/test", name)[2]
                        unregister(node, name, place)

    def node(self, script: str, *arguments: object) -> Node:
        """Starts a script of ``nodes``."""
        return Node(self._inside("python3", f"/nodes/{script}", *map(str, arguments)), ENVIRONMENT)

    def gate(self) -> Node:
        """Starts the gate as its unit does."""
        limits = ("prlimit", "--nofile=1024")  # files, which is what systemd gives a unit
        argv = self._inside("python3", "/gate/gate.py", "--config", "/params.yaml")
        return Node((*limits, *argv), ENVIRONMENT)

    def send_zero(self) -> tuple[int, str]:
        """Runs what systemd runs after the gate; returns its status and output."""
        argv = self._inside("python3", "/gate/send_zero.py", "--config", "/params.yaml")
        done = subprocess.run(
            argv, env=ENVIRONMENT, capture_output=True, text=True, check=False, timeout=PATIENCE
        )
        return done.returncode, done.stdout + done.stderr

    def _inside(self, *argv: str) -> tuple[str, ...]:
        return ("chroot", str(self.root), *argv)


def wait_until(condition: Callable[[], Any], what: str) -> Any:
    """Returns what ``condition`` returns once it is true."""
    end = time.monotonic() + PATIENCE
    while not (found := condition()):
        if time.monotonic() > end:
            raise RuntimeError(f"not in time: {what}")
        time.sleep(0.005)
    return found


def since(lines: Sequence[Any], moment: float) -> Iterator[Any]:
    """Yields the lines with a later time ``t``."""
    return (line for line in list(lines) if line["t"] > moment)


def _run(*argv: str) -> None:
    subprocess.run(argv, check=True, env={**os.environ, "PATH": processes.SEARCH_PATH})
