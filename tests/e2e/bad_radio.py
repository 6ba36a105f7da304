"""A bad Wi-Fi for a lab: packets are lost, all share a few Mbit/s, and each packet is delayed.

The kernel's token bucket limits what all hosts get from the operator and what each sends; nftables on the
hosts loses packets in both directions. ``python -m tests.e2e.bad_radio BRIDGE ADDRESS SECONDS`` delays
packets both ways, in the network namespace in which it runs: the operator's address moves behind a relay.
"""

from __future__ import annotations

import asyncio
import fcntl
import os
import re
import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from tests.e2e.at_once import at_once
from tests.e2e.lab_swarm import LabSwarm, namespace_of, quoted

_TUNSETIFF, _IFF_TAP, _IFF_NO_PI = 0x400454CA, 0x2, 0x1000  # linux/if_tun.h
LONGEST_FRAME = 2048
_BUCKET = "burst 8kb latency 400ms"  # more than a packet of 1 500 B fits, and none waits for ever
_LOSS = """\
table inet radio {{
  chain in {{
    type filter hook input priority -300
    numgen random mod 1000 < {permille} drop
  }}
  chain out {{
    type filter hook output priority -300
    oif != "lo" numgen random mod 1000 < {permille} drop
  }}
}}
"""


def spoil(swarm: LabSwarm, *, loss: float, mbit: float) -> None:
    """Gives the lab's one network this ``loss`` in each direction, and ``mbit`` Mbit/s."""
    rules = _LOSS.format(permille=round(1000 * loss))
    rate = f"root tbf rate {mbit}mbit {_BUCKET}"
    at_once(
        [
            lambda host=host: swarm.shell(
                host, f"sudo nft {quoted(rules)}; sudo tc qdisc add dev wlan0 {rate}"
            )
            for host in swarm.hosts
        ]
    )
    _inside(swarm, "tc", "qdisc", "add", "dev", "br0", *rate.split())


def repair(swarm: LabSwarm) -> None:
    """Takes loss and limits away."""
    _inside(swarm, "tc", "qdisc", "del", "dev", "br0", "root")
    for host in swarm.hosts:
        swarm.shell(host, "sudo nft delete table inet radio; sudo tc qdisc del dev wlan0 root")


def _inside(swarm: LabSwarm, *command: str) -> str:
    argv = ["nsenter", f"--net={namespace_of(swarm)}", *command]
    return subprocess.run(argv, capture_output=True, text=True, check=True).stdout


@contextmanager
def delay(swarm: LabSwarm, seconds: float) -> Iterator[None]:
    """Delays each packet by ``seconds`` between the operator and the hosts."""
    (address,) = re.findall(r"inet (\S+)", _inside(swarm, "ip", "-o", "-4", "address", "show", "dev", "br0"))
    relay = [sys.executable, "-m", "tests.e2e.bad_radio", "br0", address, str(seconds)]
    argv = ["nsenter", f"--net={namespace_of(swarm)}", *relay]
    with subprocess.Popen(argv, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"ready\n"
        try:
            yield
        finally:
            process.terminate()
            process.wait()
            _inside(swarm, "ip", "address", "add", address, "dev", "br0")


def tap(name: str) -> int:
    device = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(device, _TUNSETIFF, struct.pack("16sH", name.encode(), _IFF_TAP | _IFF_NO_PI))
    return device


async def _relay(bridge: str, address: str, seconds: float) -> None:
    loop = asyncio.get_running_loop()
    mine, others = tap("operator"), tap("air")
    for line in (
        f"address del {address} dev {bridge}",
        f"link set air master {bridge} up",
        f"address add {address} dev operator",
        "link set operator up",
    ):
        subprocess.run(["ip", *line.split()], check=True)

    def pass_on(source: int, sink: int) -> None:
        frame = os.read(source, LONGEST_FRAME)
        loop.call_later(seconds, os.write, sink, frame)

    loop.add_reader(mine, pass_on, mine, others)
    loop.add_reader(others, pass_on, others, mine)
    print("ready", flush=True)
    await asyncio.Event().wait()


if __name__ == "__main__":
    asyncio.run(_relay(sys.argv[1], sys.argv[2], float(sys.argv[3])))
