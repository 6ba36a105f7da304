"""What comes late holds nobody up: a hub's network, `network-online`, an optional host."""

from __future__ import annotations

import pytest

from tests.e2e.lab_swarm import LabSwarm, quoted
from tests.e2e.recovery import (
    BODY,
    CONTROL,
    EPUCK_PI,
    LAPTOP,
    LONGEST,
    SPECS,
    deployed,
    obeyed,
    rebooted,
    standing,
    whole,
)
from tests.timing import Promise

pytestmark = pytest.mark.slow

LATE = 8  # s after its boot at which a host gets its address
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


def test_a_network_that_comes_late_and_never_online_stops_nobody(isles: LabSwarm, promise: Promise) -> None:
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
    promise(f"leader: hub without address for {LATE} s, until healthy", seconds, LONGEST)


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
