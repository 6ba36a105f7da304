"""Recovery: whatever ends, is cut off or comes late, the swarm is whole again without a person.

Seconds count from when the cause is over: a master is killed, a host answers SSH again, a link is joined. A
swarm is whole when `status` calls it healthy and new commands move a robot of another host;
until then nobody moves.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.e2e.lab_swarm import LabSwarm, Note, lab_of, moves, quoted

LONGEST = 40.0  # s until a swarm must be whole again
DOWN = 30.0  # s for which a link is cut
LATE = 8  # s after its boot at which a host gets its address
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
    "leader": BODY.format(mode="mode: leader\nleader: koala-laptop", optional="") + CONTROL,
    "central": BODY.format(mode="mode: central\nhub: koala-laptop", optional=""),
    "standalone": BODY.format(mode="mode: standalone", optional="") + CONTROL + STATIC % LAPTOP,
    "combined": BODY.format(mode="mode: combined", optional="") + CONTROL + ISLANDS + STATIC % "big",
}
SINGLE_MINDED = (
    BODY.format(mode="mode: single-minded\nleader: koala-laptop", optional="")
    .replace("host: k3-pi", "host: koala-laptop")
    .replace("host: epuck-pi", "host: koala-laptop")
)
COMMANDING = dict.fromkeys(("single-minded", "leader", "standalone", "combined"), LAPTOP) | {"central": K3_PI}


@pytest.fixture(scope="module")
def isles(workplace: Path) -> Iterator[LabSwarm]:
    """A lab of three hosts and three robots, in whichever mode a test deploys."""
    folder = workplace / "recovery"
    folder.mkdir()
    spec = folder / "leader.yaml"
    spec.write_text(SPECS["leader"])
    with lab_of(f"rec-{os.getpid()}", spec, folder) as swarm:
        yield swarm


def deployed(swarm: LabSwarm, name: str, text: str) -> Path:
    """Bring the lab to what a spec says."""
    spec = swarm.folder / f"{name}.yaml"
    spec.write_text(text)
    run = swarm.deploy(spec)
    assert run.status == 0, run.out + run.err
    return spec


def whole(swarm: LabSwarm, spec: Path) -> float:
    """Look until the swarm is healthy; the seconds that took."""
    began = time.monotonic()
    while True:
        run = swarm.swarmctl("status", "--window", "0.5", spec=spec)
        if run.status == 0:
            return time.monotonic() - began
        assert time.monotonic() - began < LONGEST, run.out + run.err


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
HUB = ("hub rebooted", rebooted(LAPTOP))
PEER = ("bridge peer rebooted", rebooted(K3_PI))
LINK = (f"leader's link down {DOWN:g} s", cut_off)
TABLE = {
    "leader": (KILLED, HUB, LINK),
    "central": (KILLED, HUB, LINK),
    "standalone": (KILLED, HUB, LINK, PEER),
    "combined": (KILLED, HUB, LINK, PEER),
}


@pytest.mark.parametrize("mode", TABLE)
def test_the_swarm_is_whole_again_by_itself(isles: LabSwarm, mode: str, note: Note) -> None:
    recovers(isles, deployed(isles, mode, SPECS[mode]), mode, TABLE[mode], note)


def test_a_single_minded_swarm_is_whole_again_by_itself(workplace: Path, note: Note) -> None:
    """One host has it all: no link can be cut, and there is no peer."""
    folder = workplace / "alone"
    folder.mkdir()
    spec = folder / "single-minded.yaml"
    spec.write_text(SINGLE_MINDED)
    with lab_of(f"one-{os.getpid()}", spec, folder) as swarm:
        mode = "single-minded"
        recovers(swarm, deployed(swarm, mode, SINGLE_MINDED), mode, (KILLED, HUB), note)


def recovers(
    swarm: LabSwarm,
    spec: Path,
    mode: str,
    faults: Sequence[tuple[str, Callable[[LabSwarm], None]]],
    note: Note,
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
        note(f"{mode}: {what}", f"healthy {healthy:.1f} s, robot moves {moving:.1f} s", f"<= {LONGEST:g} s")


def processes(swarm: LabSwarm, host: str) -> dict[str, int]:
    """How many masters, drivers and multimasters run on a host, whoever started them."""
    output = swarm.shell(host, "ps -eo args")
    return {
        what: sum(program in line for line in output.splitlines())
        for what, program in {
            "master": "rosmaster --core", "driver": "serial_driver.py",
            "multimaster": "static_multimaster.py",
        }.items()
    }  # fmt: skip


def converted(swarm: LabSwarm, spec: Path, mode: str) -> None:
    """The spec as `mode convert` writes it; of several masters one receives k3's odometry."""
    spec.write_text("".join(one for one in spec.read_text().splitlines(True) if "multimaster" not in one))
    run = swarm.run("mode", "convert", str(spec), "--to", mode, "--write")
    assert run.status == 0, run.err
    receiver = {"standalone": LAPTOP, "combined": "main"}.get(mode)
    spec.write_text(spec.read_text() + (STATIC % receiver if receiver else ""))


def test_a_deployed_swarm_changes_its_mode_and_leaves_nothing_behind(isles: LabSwarm) -> None:
    """Leader, standalone, combined, leader: what is to run runs and nothing else, and robots stand still."""
    spec = deployed(isles, "walk", SPECS["leader"])
    whole(isles, spec)
    before = {host: processes(isles, host) for host in isles.hosts}
    for mode, masters in (("standalone", 3), ("combined", 2), ("leader", 1)):
        converted(isles, spec, mode)
        with standing(isles):
            run = isles.deploy(spec)
            assert run.status == 0, run.out + run.err
            whole(isles, spec)
        now = {host: processes(isles, host) for host in isles.hosts}
        assert sum(one["master"] for one in now.values()) == masters
        assert all(one["driver"] == 1 for one in now.values())
        assert isles.plan(spec).status == 0
    assert now == before
    obeyed(isles, LAPTOP)


NO_NETWORK = f"""\
[Unit]
DefaultDependencies=no
Before=sysinit.target network-online.target
[Service]
Type=exec
ExecStartPre=ip address flush dev wlan0
ExecStart=sh -c "sleep {LATE}; exec ip address add 192.168.77.10/24 dev wlan0"
"""
NEVER_ONLINE = """\
[Unit]
Before=network-online.target
[Service]
Type=oneshot
ExecStart=sleep infinity
"""


def test_a_network_that_comes_late_and_never_online_stops_nobody(isles: LabSwarm, note: Note) -> None:
    """The hub boots without its address, and who waits for `network-online` waits for ever."""
    spec = deployed(isles, "leader", SPECS["leader"])
    units = {"no-network": ("sysinit", NO_NETWORK), "never-online": ("network-online", NEVER_ONLINE)}
    for name, (target, text) in units.items():
        path = f"/etc/systemd/system/{name}.service"
        isles.shell(LAPTOP, f"printf %s {quoted(text)} | sudo tee {path} && "
                            f"sudo systemctl add-wants {target}.target {name}.service && sync")  # fmt: skip
    with standing(isles):
        rebooted(LAPTOP)(isles)
        seconds = whole(isles, spec)
    show = "systemctl show -P NRestarts -P ActiveEnterTimestampMonotonic swarm-newswarm"
    restarts, driver = isles.shell(LAPTOP, f"{show}.koala.service").split()
    crashes, master = isles.shell(LAPTOP, f"{show}.master.service").split()
    assert (int(master) - int(driver)) / 1e6 > LATE / 2, "the driver watches over its robot before"
    assert (restarts, crashes) == ("0", "0"), "both wait, and neither crashes"
    obeyed(isles, LAPTOP)
    for name, (target, _) in units.items():
        isles.shell(LAPTOP, f"cd /etc/systemd/system; sudo rm -r {name}.service {target}.target.wants")
    note(f"leader: hub without address for {LATE} s", f"healthy {seconds:.1f} s", f"<= {LONGEST:g} s")


def test_an_optional_host_holds_nobody_up_and_joins_late(isles: LabSwarm) -> None:
    isles.kill(EPUCK_PI)
    text = BODY.format(mode="mode: leader\nleader: koala-laptop", optional=", optional: true") + CONTROL
    spec = deployed(isles, "without", text)
    whole(isles, spec)
    obeyed(isles, LAPTOP)
    isles.start(EPUCK_PI)
    with standing(isles):
        assert deployed(isles, "without", text) == spec
        whole(isles, spec)
    with isles.driving(LAPTOP, "epuck", 0.05):
        pass
    isles.seconds_to_standstill("epuck")
