"""Real islands on one machine, a network namespace each: real rosmasters, the real static multimaster.

Runs in namespaces of its own (``sealed`` and ``unshare --net``): when it ends, everything is gone.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import xmlrpc.client
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from swarmctl.resources import onboard

#: An empty folder on every machine; a tmpfs is mounted over it.
PLACE = Path("/mnt")
PORT = 11311
ISLANDS = ("north", "east", "west")
PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
#: A master whose subscribers hang must not hang itself: few seconds a call, a worker for each peer and more.
MASTER_OPTIONS = ("-w", "16", "-t", "2")
#: Cuts an island off from the addresses in a set, silently.
RULES = """table inet cut {
set away { type ipv4_addr; }
chain input { type filter hook input priority 0; ip saddr @away drop; }
chain output { type filter hook output priority 0; ip daddr @away drop; }
}"""


def address(island: str) -> str:
    return f"10.9.0.{ISLANDS.index(island) + 1}"


def master_uri(island: str) -> str:
    return f"http://{address(island)}:{PORT}"


def sync_node(island: str) -> str:
    return f"/multimaster_{island}"


def parameters(
    island: str, received: Mapping[str, Sequence[str]], kind: str, **times: float
) -> dict[str, Any]:
    """The parameter file of ``island``, which receives topics of each peer."""
    return {
        "island": island,
        "node": sync_node(island),
        "master": master_uri(island),
        "address": address(island),
        "poll_hz": 1.0,
        "silent_after": 1.5,
        "remove_after": 4.0,
        **times,
        "peers": [
            {
                "island": peer,
                "master": master_uri(peer),
                "hosts": [address(peer)],
                "receives": [{"topic": topic, "type": kind} for topic in topics],
            }
            for peer, topics in received.items()
        ],
    }


class Archipelago:
    """Islands on one wire. ``image`` is the lab's file system with ROS in it; it is not written to."""

    def __init__(self, image: Path) -> None:
        self._masters: dict[str, subprocess.Popen[bytes]] = {}
        self._syncs: dict[str, subprocess.Popen[bytes]] = {}
        self.root = PLACE / "root"
        _disk(image, self.root)
        _run("ip", "link", "add", "wire", "type", "bridge")
        _run("ip", "link", "set", "wire", "up")
        _run("ip", "addr", "add", "10.9.0.254/24", "dev", "wire")
        for island in ISLANDS:
            _island(island)
            self.run_in(island, "nft", RULES)

    def popen(self, island: str, *argv: str, chroot: bool = True, **options: Any) -> subprocess.Popen[bytes]:
        """A process on ``island``, in the image's file system or in this machine's."""
        place = ("chroot", str(self.root)) if chroot else ()
        return subprocess.Popen(
            ("ip", "netns", "exec", island, *place, *argv), env=environment(island), **options
        )

    def start_master(self, island: str) -> None:
        """Start the master; waits until it answers."""
        argv = ("rosmaster", "--core", "-p", str(PORT), *MASTER_OPTIONS)
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self._masters[island] = self.popen(island, *argv, **quiet)
        probe = f"import xmlrpc.client as x; x.ServerProxy('{master_uri(island)}').getPid('/probe')"
        for _ in range(100):
            if self.popen(island, sys.executable, "-c", probe, chroot=False, **quiet).wait() == 0:
                return
            time.sleep(0.05)
        raise RuntimeError(f"the master of {island} does not start")

    def kill_master(self, island: str) -> None:
        _end(self._masters.pop(island), signal.SIGKILL)

    def configure(self, island: str, settings: Mapping[str, Any]) -> None:
        (self.root / "sync" / f"{island}.yaml").write_text(json.dumps(settings))

    def start_sync(self, island: str) -> None:
        log = (PLACE / f"{island}.log").open("ab")
        argv = ("python3", "-B", "/sync/static_multimaster.py", "--config", f"/sync/{island}.yaml")
        self._syncs[island] = self.popen(island, *argv, stdout=log, stderr=log)

    def end_sync(self, island: str, number: signal.Signals) -> float:
        """End the static multimaster; returns the s it took."""
        start = time.monotonic()
        _end(self._syncs.pop(island), number)
        return time.monotonic() - start

    def log(self, island: str) -> str:
        return (PLACE / f"{island}.log").read_text()

    def cut(self, one: str, other: str) -> None:
        """Drop all packets between two islands, without a reset."""
        for here, there in ((one, other), (other, one)):
            self.run_in(here, "nft", f"add element inet cut away {{ {address(there)} }}")

    def heal(self) -> None:
        for island in ISLANDS:
            self.run_in(island, "nft", "flush set inet cut away")

    def run_in(self, island: str, *argv: str) -> None:
        """Run a program of the image on ``island``."""
        _in(island, "chroot", str(self.root), *argv)

    def master(self, island: str) -> xmlrpc.client.ServerProxy:
        """Reached from outside all islands, so never cut off."""
        return xmlrpc.client.ServerProxy(master_uri(island))


def environment(island: str) -> dict[str, str]:
    return {
        "PATH": PATH,
        "LC_ALL": "C.UTF-8",
        "HOME": "/tmp",
        "ROS_LOG_DIR": "/tmp/log",
        "ROS_MASTER_URI": master_uri(island),
        "ROS_IP": address(island),
        "PYTHONUNBUFFERED": "1",
        "PYTHONDONTWRITEBYTECODE": "1",
    }


def _disk(image: Path, root: Path) -> None:
    _run("mount", "-t", "tmpfs", "archipelago", str(PLACE))
    for name in ("root", "upper", "work"):
        (PLACE / name).mkdir()
    layers = f"lowerdir={image},upperdir={PLACE / 'upper'},workdir={PLACE / 'work'}"
    _run("mount", "-t", "overlay", "archipelago", "-o", layers, str(root))
    _run("mount", "-t", "proc", "proc", str(root / "proc"))
    _run("mount", "--rbind", "/dev", str(root / "dev"))
    (root / "sync").mkdir()
    _run("cp", "-rT", str(onboard() / "nodes/multimaster"), str(root / "sync"))
    _run("cp", "-r", str(onboard()), str(root / "sync"))
    Path("/run/netns").mkdir(exist_ok=True)
    _run("mount", "-t", "tmpfs", "archipelago", "/run/netns")


def _island(island: str) -> None:
    _run("ip", "netns", "add", island)
    _run("ip", "link", "add", island, "type", "veth", "peer", "name", "eth0", "netns", island)
    _run("ip", "link", "set", island, "master", "wire", "up")
    _in(island, "ip", "addr", "add", f"{address(island)}/24", "dev", "eth0")
    _in(island, "ip", "link", "set", "eth0", "up")
    _in(island, "ip", "link", "set", "lo", "up")


def _in(island: str, *argv: str) -> None:
    _run("ip", "netns", "exec", island, *argv)


def _run(*argv: str) -> None:
    subprocess.run(argv, check=True, env={**os.environ, "PATH": PATH})


def _end(process: subprocess.Popen[bytes], number: signal.Signals) -> None:
    process.send_signal(number)
    process.wait()
