"""Specs, faults and waits of the tests of recovery.

Seconds count from when the cause is over: a master is killed, a host answers SSH again, a link is joined. A
swarm is whole when `status` calls it healthy and new commands move a robot of another host;
until then nobody moves.
"""

from __future__ import annotations

import os
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from tests.e2e.lab_swarm import LabSwarm, lab_of, moves, until
from tests.e2e.security_level import pinned, secured
from tests.timing import Promise

LONGEST = 40.0  # s, promised until a swarm is whole again
DOWN = 30.0  # s for which a link is cut
LAPTOP, K3_PI, EPUCK_PI = "koala-laptop", "k3-pi", "epuck-pi"
BODY = """\
version: 1
name: newswarm
{mode}
hosts:
  koala-laptop: {{address: 192.168.77.10, computer: laptop}}
  k3-pi: {{address: 192.168.77.11, computer: raspberry-pi-2b}}
  epuck-pi: {{address: 192.168.77.12, computer: raspberry-pi-2b{optional}}}
robots:
  koala: {{type: koala, host: koala-laptop}}
  k3: {{type: khepera3, host: k3-pi}}
  epuck: {{type: epuck, host: epuck-pi}}
links:
  - {{kind: wlan, name: lab, hosts: [koala-laptop, k3-pi, epuck-pi], multicast: false}}
  - {{kind: serial, host: koala-laptop, robot: koala, usb: {{serial: A600dXyz}}}}
  - {{kind: serial, host: k3-pi, robot: k3, usb: {{serial: FTDI1234}}}}
  - {{kind: serial, host: epuck-pi, robot: epuck, usb: {{serial: EPUCK1}}}}
"""
CONTROL = "control: [{by: koala-laptop, of: [koala, k3, epuck]}]\n"
STATIC = "multimaster: {provider: static, topics: [{topic: /k3/odom, to: [%s]}]}\n"
ISLANDS = """\
islands:
  big: {mode: leader, leader: koala-laptop, hosts: [koala-laptop, epuck-pi]}
  small: {mode: central, hub: k3-pi, hosts: [k3-pi]}
"""
SPECS: Mapping[str, str] = {
    "single-minded": BODY.format(mode="mode: single-minded\nleader: koala-laptop", optional="")
    .replace("host: k3-pi", "host: koala-laptop")
    .replace("host: epuck-pi", "host: koala-laptop"),
    "leader": BODY.format(mode="mode: leader\nleader: koala-laptop", optional="") + CONTROL,
    "central": BODY.format(mode="mode: central\nhub: koala-laptop", optional=""),
    "standalone": BODY.format(mode="mode: standalone", optional="") + CONTROL + STATIC % LAPTOP,
    "combined": BODY.format(mode="mode: combined", optional="") + CONTROL + ISLANDS + STATIC % "big",
}
COMMANDING = dict.fromkeys(("single-minded", "leader", "standalone", "combined"), LAPTOP) | {"central": K3_PI}


@contextmanager
def lab_of_isles(workplace: Path, mode: str) -> Iterator[LabSwarm]:
    """A lab of the hosts and robots of ``SPECS[mode]``."""
    folder = Path(tempfile.mkdtemp(prefix="rec-", dir=workplace))
    spec = folder / f"{mode}.yaml"
    spec.write_text(secured(SPECS[mode]))
    with lab_of(f"{mode[:3]}-{os.getpid()}", spec, folder) as swarm:
        yield swarm


def deployed(swarm: LabSwarm, name: str, text: str) -> Path:
    """Bring the lab to what a spec says."""
    spec = swarm.folder / f"{name}.yaml"
    spec.write_text(secured(text))
    pinned(swarm, spec)
    run = swarm.deploy(spec)
    assert run.status == 0, run.out + run.err
    return spec


def whole(swarm: LabSwarm, spec: Path) -> float:
    """Look until the swarm is healthy; the seconds that took."""
    status = ("status", "--window", "0.5")
    return until(
        lambda: swarm.swarmctl(*status, spec=spec).status == 0, lambda: swarm.swarmctl(*status, spec=spec).out
    )


@contextmanager
def standing(swarm: LabSwarm) -> Iterator[None]:
    """Nobody moves as long as this lasts."""
    moved: dict[str, None] = {}
    done = threading.Event()

    def look() -> None:
        while not done.wait(0.02):
            moved.update(dict.fromkeys(name for name, state in swarm.robots().items() if moves(state)))

    thread = threading.Thread(target=look)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
    assert not moved, f"moved without commands: {', '.join(moved)}"


def obeyed(swarm: LabSwarm, host: str) -> None:
    """Commands from ``host`` move k3, and no other robot."""
    with swarm.driving(host, "k3", 0.1):
        states = swarm.robots()
        assert not moves(states["koala"])
        assert not moves(states["epuck"])
    swarm.seconds_to_standstill("k3")


def master_killed(swarm: LabSwarm) -> None:
    swarm.shell(LAPTOP, "sudo systemctl kill -s KILL swarm-newswarm.master.service")


def bridge_ended(swarm: LabSwarm) -> None:
    """By SIGTERM, on which it ends with exit code 0."""
    unit = "swarm-newswarm.multimaster.service"
    swarm.shell(LAPTOP, f"sudo systemctl kill --kill-who=main -s TERM {unit}")


def rebooted(host: str) -> Callable[[LabSwarm], None]:
    def reboot(swarm: LabSwarm) -> None:
        swarm.kill(host)
        swarm.start(host)

    return reboot


def cut_off(swarm: LabSwarm) -> None:
    swarm.cut(LAPTOP)
    time.sleep(DOWN)  # it is the length of the silence that counts: longer than any connection is waited for
    swarm.join(LAPTOP)


KILLED = ("master killed", master_killed)
ENDED = ("bridge ended", bridge_ended)
HUB = ("hub rebooted", rebooted(LAPTOP))
PEER = ("bridge peer rebooted", rebooted(K3_PI))
LINK = (f"leader's link down {DOWN:g} s", cut_off)


def recovers(
    swarm: LabSwarm,
    spec: Path,
    mode: str,
    faults: Sequence[tuple[str, Callable[[LabSwarm], None]]],
    promise: Promise,
) -> None:
    """After each fault the swarm is whole again, and nobody moves before; the seconds go into the table."""
    obeyed(swarm, COMMANDING[mode])
    for what, happen in faults:
        with standing(swarm):
            happen(swarm)
            healthy = whole(swarm, spec)
        began = time.monotonic()
        obeyed(swarm, COMMANDING[mode])
        moving = healthy + time.monotonic() - began
        promise(f"{mode}: {what}, until healthy and a robot moves", moving, LONGEST)
