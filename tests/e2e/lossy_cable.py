"""A host's cable on which packets are lost or late at random; those of the operator are spared.

``python -m tests.e2e.lossy_cable PORT BRIDGE SHARE SEED`` does it in the network namespace in which it runs,
until its input ends: the port moves to a bridge of its own, behind a relay. Then it prints what it did.
The operator is who has the bridge's address.
"""

from __future__ import annotations

import asyncio
import json
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from random import Random

from swarmctl.lab import lab
from swarmctl.lab.hosts import network
from tests import ROOT
from tests.child_process import child_process
from tests.e2e.bad_radio import LONGEST_FRAME, tap
from tests.e2e.lab_swarm import LabSwarm, namespace_of

LATE = (0.1, 0.5)  # s, the least and the most
_OTHER_ADDRESS = "02:00:00:00:00:01"
_ADDRESSES = 12  # bytes of a frame: whom it is for, and who sent it


@contextmanager
def lossy_cable(swarm: LabSwarm, host: str, share: float, seed: int) -> Iterator[Counter[str]]:
    """Loses ``share`` of the packets from and to ``host``, and delays another ``share`` by ``LATE``.

    Yields a counter that is filled on leaving: packets ``seen``, ``lost`` and ``late``.
    """
    plan, found = lab.plan(swarm.name), Counter[str]()
    (link,) = (one.network for one in plan.host(host).interfaces)
    port, bridge = network.port(plan, host, link), network.bridge(plan, link)
    module = [sys.executable, "-m", "tests.e2e.lossy_cable", port, bridge, str(share), str(seed)]
    argv = ["nsenter", f"--net={namespace_of(swarm)}", *module]
    with child_process(argv, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=ROOT) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        yield found
        process.stdin.close()
        found.update(json.loads(process.stdout.readline()))


class _Cable:
    """Two devices, between which frames pass."""

    def __init__(self, spared: bytes, share: float, seed: int) -> None:
        self.far, self.near = tap("far"), tap("near")
        self.did = Counter[str]()
        self._spared, self._share, self._random = spared, share, Random(seed)

    def pass_on(self, source: int, sink: int) -> None:
        frame = os.read(source, LONGEST_FRAME)
        if self._spared in frame[:_ADDRESSES]:
            os.write(sink, frame)
            return
        self.did["seen"] += 1
        fate = self._random.random()
        if fate < self._share:
            self.did["lost"] += 1
        elif fate < 2 * self._share:
            self.did["late"] += 1
            asyncio.get_running_loop().call_later(self._random.uniform(*LATE), os.write, sink, frame)
        else:
            os.write(sink, frame)


async def _relay(port: str, bridge: str, share: float, seed: int) -> None:
    shown = subprocess.run(["ip", "-j", "link", "show", bridge], capture_output=True, check=True).stdout
    operator = json.loads(shown)[0]["address"]
    cable = _Cable(bytes.fromhex(operator.replace(":", "")), share, seed)
    loop, ended = asyncio.get_running_loop(), asyncio.Event()
    for line in (
        f"link set {bridge} address {operator}",  # or it would become that of the port with the lowest
        "link add lossy type bridge forward_delay 0 mcast_snooping 0",
        f"link set far master {bridge} up",
        "link set far type bridge_slave mcast_flood off",
        "link set near master lossy up",
        f"link set {port} master lossy address {_OTHER_ADDRESS}",  # its own may be the operator's
        "link set lossy arp off up",
    ):
        subprocess.run(["ip", *line.split()], check=True)
    loop.add_reader(cable.near, cable.pass_on, cable.near, cable.far)
    loop.add_reader(cable.far, cable.pass_on, cable.far, cable.near)
    loop.add_reader(sys.stdin, ended.set)
    print("ready", flush=True)
    await ended.wait()
    subprocess.run(["ip", "link", "set", port, "master", bridge], check=True)
    subprocess.run(["ip", "link", "delete", "lossy"], check=True)
    print(json.dumps(cable.did), flush=True)


if __name__ == "__main__":
    asyncio.run(_relay(sys.argv[1], sys.argv[2], float(sys.argv[3]), int(sys.argv[4])))
