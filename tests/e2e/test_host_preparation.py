"""What a deploy changes on a host beside ROS: clock and names; and that removing leaves nothing of it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.e2e.lab_swarm import (
    HOME,
    LabSwarm,
    Note,
    SshError,
    lab_of,
    quoted,
    until,
)
from tests.timing import Promise

SPEC = """\
version: 1
name: newswarm
mode: central
hub: laptop
hosts:
  laptop: {address: 192.168.77.10, user: robot, computer: laptop}
  pi: {address: 192.168.77.11, user: robot, bluetooth: [hci0]}
robots:
  k3: {type: khepera3, host: pi}
  epuck: {type: epuck, host: pi}
links:
  - {kind: wlan, name: lab, hosts: [laptop, pi]}
  - {kind: serial, host: pi, robot: k3, usb: {serial: FTDI1234}}
  - {kind: bluetooth, host: pi, robot: epuck, mac: "10:00:e8:c5:64:37", pin: {secret: epuck-pin}}
"""
CHRONY = "/etc/chrony/chrony.conf"
# A lab's host has no clock of its own to set. `-x` leaves the clock alone; all else of chronyd is real.
UNSETTABLE = (
    "sudo mkdir -p /etc/systemd/system/chrony.service.d && "
    "printf '[Unit]\\nConditionCapability=\\n' | sudo tee /etc/systemd/system/chrony.service.d/lab.conf && "
    "echo 'DAEMON_OPTS=\"-F 0 -x\"' | sudo tee /etc/default/chrony && "
    "sudo systemctl daemon-reload && sudo systemctl start chrony"
)
SITE_RULES = """\
table inet site {
  set trusted {
    type ipv4_addr; flags interval
    elements = { 192.168.77.0/24 }
  }
  chain input {
    type filter hook input priority 0; policy drop
    iif "lo" accept
    ct state established,related accept
    ip saddr @trusted accept
  }
}
table ip site_nat {
  chain out {
    type nat hook postrouting priority 100
    ip daddr 10.0.0.0/8 masquerade
  }
}
"""
PIN = "49713"
PAIR = "swarm-newswarm.epuck.pair.service"
VAULT = "/etc/swarm/newswarm/secrets"
DROP_IN = f"/etc/systemd/system/{PAIR}.d"
HERE_AND_NOW = (
    "[Unit]\\nConditionPathExists=\\nConditionPathExists=/etc/swarm/newswarm/secrets/epuck-pin\\n"
    "[Service]\\nEnvironment=SWARM_RADIOS=/run/radios PATH=/usr/local/bin:/usr/bin:/bin\\n"
)
BUSCTL = r"""#!/bin/sh
case "$*" in
*Adapter1\ Address) echo 's "00:11:22:33:44:55"' ;;
*Device1\ Paired) exit 1 ;;
esac
"""
BLUETOOTHCTL = r"""#!/bin/sh
echo "Agent registered"
while read -r verb rest; do
  case $verb in
  scan) echo "[NEW] Device 10:00:E8:C5:64:37 e-puck" ;;
  pair) echo "[agent] Enter PIN code: "; read -r pin
    [ "$pin" = 49713 ] && echo "Pairing successful" || echo "Failed to pair: x" ;;
  *) echo "$verb succeeded" ;;
  esac
done
"""


# /var/lib/chrony is chronyd's own, /var/lib/systemd has the time of the clock.
EVERYTHING = r"""
sudo find / \( -path /proc -o -path /sys -o -path /dev -o -path /run -o -path /tmp -o -path /var/tmp \
  -o -path /var/log -o -path /var/lib/chrony -o -path /var/lib/systemd \) -prune \
  -o -path '/etc/*' -type f -printf '%p %m %u:%g\n' -o -type f -printf '%p %m %u:%g %s %T@\n' \
  -o -type l -printf '%p -> %l\n' -o -printf '%p %y %m %u:%g\n'
sudo find /etc -type f -exec md5sum {} +
getent passwd; getent group
systemctl list-unit-files --no-legend --no-pager
systemctl list-units --all --no-legend --no-pager --plain 'swarm*'
"""


@pytest.fixture(scope="module")
def pair(workplace: Path) -> Iterator[LabSwarm]:
    """A lab of two hosts on which chronyd runs as the distribution brings it."""
    spec = workplace / "pair.yaml"
    spec.write_text(SPEC)
    folder = workplace / "pair"
    folder.mkdir()
    with lab_of(f"pair-{os.getpid()}", spec, folder) as swarm:
        swarm.everywhere(UNSETTABLE)
        yield swarm


@pytest.fixture(scope="module")
def before(pair: LabSwarm) -> dict[str, str]:
    return everything(pair)


@pytest.fixture(scope="module")
def firewall(pair: LabSwarm) -> dict[str, str]:
    """What nft lists on every host, with tables of the site."""
    pair.everywhere(f"sudo nft {quoted(SITE_RULES)}")
    return rulesets(pair)


@pytest.fixture(scope="module")
def deployed(pair: LabSwarm, before: dict[str, str], firewall: dict[str, str]) -> LabSwarm:
    run = pair.deploy()
    assert run.status == 0, run.out + run.err
    return pair


def everything(swarm: LabSwarm) -> dict[str, str]:
    """What every host has: files with mode and owner, below /etc with a digest and elsewhere with size and
    time of the last change; folders, links, accounts, groups, units."""
    return swarm.everywhere(EVERYTHING)


def rulesets(swarm: LabSwarm) -> dict[str, str]:
    return swarm.everywhere("sudo nft -j list ruleset")


def test_a_host_follows_the_hubs_clock_without_internet(deployed: LabSwarm, promise: Promise) -> None:
    def selected() -> bool:
        try:
            return "^* 192.168.77.10" in deployed.shell("pi", "chronyc -n sources")
        except SshError:  # chronyd is not up yet
            return False

    seconds = until(selected, "pi does not select the hub's clock")
    tracking = dict(
        (part.strip() for part in line.split(":", 1))
        for line in deployed.shell("pi", "chronyc -n tracking").splitlines()
    )
    assert "192.168.77.10" in tracking["Reference ID"]
    assert tracking["Leap status"] == "Normal"
    assert tracking["Stratum"] == "11"
    promise("clock: the hub is selected, no internet", seconds, 30)


def test_a_second_deploy_restarts_no_chronyd(deployed: LabSwarm) -> None:
    pids = deployed.everywhere("pidof chronyd")
    assert deployed.deploy().status == 0
    assert deployed.everywhere("pidof chronyd") == pids


def test_a_hand_edit_of_our_lines_is_planned_and_repaired(deployed: LabSwarm) -> None:
    deployed.shell("pi", f"sudo sed -i 's/prefer trust/prefer/' {CHRONY}")
    steps = [(kind, target) for kind, target, _ in deployed.steps()["pi"]]
    assert steps == [("write-block", CHRONY), ("reload", "chrony")]
    assert "/etc/chrony/chrony.conf was edited on the host" in deployed.deploy().out
    assert deployed.deploy(None, "--overwrite-edits").status == 0
    assert "prefer trust" in deployed.shell("pi", f"cat {CHRONY}")
    assert deployed.steps() == {}


def test_every_host_knows_every_other_by_name(deployed: LabSwarm) -> None:
    for host in deployed.hosts:
        for other, address in deployed.hosts.items():
            assert address in deployed.shell(host, f"getent ahostsv4 {other}")


def test_a_host_without_chrony_is_deployed_to_with_a_note(deployed: LabSwarm) -> None:
    deployed.shell("pi", f"sudo mv /usr/sbin/chronyd /usr/sbin/away; sudo mv {CHRONY} {CHRONY}.away")
    try:
        plan = deployed.plan()
        assert plan.status == 0, plan.out
        assert "note: pi: it lacks chrony" in plan.out
        assert "apt install chrony" in plan.out
        assert "it lacks chrony" in deployed.deploy().out
    finally:
        deployed.shell("pi", f"sudo mv /usr/sbin/away /usr/sbin/chronyd; sudo mv {CHRONY}.away {CHRONY}")


def test_a_pin_reaches_the_unit_that_pairs_and_nobody_else(deployed: LabSwarm, note: Note) -> None:
    """No adapter is at hand: bluetoothctl and busctl are stand-ins, all around them is as on a robot."""
    output = deployed.plan().out
    assert "the secret epuck-pin is missing on the host and beside the spec" in output
    for name, text in (("busctl", BUSCTL), ("bluetoothctl", BLUETOOTHCTL)):
        deployed.shell(
            "pi",
            f"printf %s {quoted(text)} | sudo tee /usr/local/bin/{name}; sudo chmod +x /usr/local/bin/{name}",
        )
    deployed.shell("pi", f"sudo mkdir -p /run/radios {DROP_IN}")
    deployed.shell(
        "pi", f"printf {quoted(HERE_AND_NOW)} | sudo tee {DROP_IN}/lab.conf; sudo systemctl daemon-reload"
    )
    folder = deployed.spec.parent / "secrets"
    folder.mkdir()
    (folder / "epuck-pin").write_text(f"{PIN}\n")
    (folder / "epuck-pin").chmod(0o600)
    steps = [(kind, target) for kind, target, _ in deployed.steps()["pi"]]
    assert steps == [("secret", "epuck-pin"), ("restart", PAIR)]
    run = deployed.deploy()
    assert run.status == 0, run.out + run.err
    journal = f"sudo journalctl --boot --output=cat --unit {PAIR}"
    seconds = until(lambda: "is paired" in deployed.shell("pi", journal), "the robot is not paired")
    note("Bluetooth: paired by the PIN (stand-ins)", f"{seconds:.1f} s after the deploy", "")
    assert "root 600" in deployed.shell("pi", f"sudo stat -c '%U %a' {VAULT}/epuck-pin")
    assert PIN not in run.out + run.err + deployed.shell("pi", "sudo journalctl --boot --output=cat")
    assert "no" in deployed.shell("pi", f"sudo grep -rqs {PIN} {HOME}/ || echo no")
    assert deployed.steps() == {}
    deployed.shell("pi", f"sudo rm -r {DROP_IN} /usr/local/bin/busctl /usr/local/bin/bluetoothctl")


# An older daemon, which does not know what the next release writes into its file.
OLD_CHRONYD = """#!/bin/sh
if grep -q "^server" /etc/chrony/chrony.conf; then
  echo "Fatal error : Could not parse server directive at line 9 in file /etc/chrony/chrony.conf" >&2
  exit 1
fi
exec /usr/sbin/away "$@"
"""


def test_a_file_that_its_daemon_refuses_takes_the_change_back(deployed: LabSwarm) -> None:
    before = deployed.shell("laptop", f"cat {CHRONY}"), deployed.release("laptop")
    more = deployed.variant("servers", ("mode: central", "mode: central\ntime: {servers: [192.168.77.99]}"))
    daemon = "/usr/sbin/chronyd"
    deployed.shell(
        "laptop",
        f"sudo mv {daemon} /usr/sbin/away; printf %s {quoted(OLD_CHRONYD)} | sudo tee {daemon};"
        f"sudo chmod +x {daemon}",
    )
    try:
        run = deployed.deploy(more, "--limit", "laptop")
    finally:
        deployed.shell("laptop", f"sudo mv /usr/sbin/away {daemon}")
    assert run.status == 3, run.out + run.err
    assert "Could not parse server directive" in run.out
    assert f"undone, release {before[1]} runs again" in run.out
    assert (deployed.shell("laptop", f"cat {CHRONY}"), deployed.release("laptop")) == before
    assert deployed.shell("laptop", "systemctl is-active chrony").strip() == "active"
    assert deployed.plan().status == 0


@pytest.mark.slow
def test_a_sites_own_firewall_is_untouched_by_all_that_swarmctl_does(
    deployed: LabSwarm, firewall: dict[str, str]
) -> None:
    assert all("site" in rules for rules in firewall.values())
    assert rulesets(deployed) == firewall  # after the first deploy
    slower = "k3: {type: khepera3, host: pi}", "k3: {type: khepera3, host: pi, settings: {rates: {odom: 4}}}"
    for run in (
        deployed.deploy(),
        deployed.deploy(deployed.variant("slower", slower)),
        deployed.swarmctl("rollback", "--yes"),
    ):
        assert run.status == 0, run.out + run.err
        assert rulesets(deployed) == firewall


def test_removed_nothing_is_left(
    deployed: LabSwarm, before: dict[str, str], firewall: dict[str, str]
) -> None:
    """But the record of who drove, which docs/hosts.md names."""
    run = deployed.swarmctl("remove", "--yes")
    assert run.status == 0, run.out + run.err
    for host, after in everything(deployed).items():
        differences = {*after.splitlines()} ^ {*before[host].splitlines()}
        assert sorted(one for one in differences if "/swarm-commands" not in one) == []
    assert rulesets(deployed) == firewall
    assert "swarm" not in deployed.shell("pi", "ls /run")
    sources = deployed.shell("pi", "chronyc -n sources")
    assert "192.168.77.10" not in sources


# A package source in a folder, with two packages of empty programs; no mirror is in reach.
PACKAGES = r"""set -e
sudo mkdir -p /opt/source && sudo chmod 777 /opt/source && cd /opt/source
make() { # name, programs
  name=$1; shift; mkdir -p $name/DEBIAN $name/usr/bin
  for program; do printf '#!/bin/sh\n' > $name/usr/bin/$program; chmod 755 $name/usr/bin/$program; done
  printf 'Package: %s\nVersion: 1.0\nArchitecture: all\nMaintainer: l <l@lab>\nDescription: a stand-in\n' \
    $name > $name/DEBIAN/control
  dpkg-deb --root-owner-group --build $name $name.deb > /dev/null
  { cat $name/DEBIAN/control; printf 'Filename: ./%s.deb\nSize: %s\nSHA256: %s\n\n' $name \
    $(stat -c %s $name.deb) $(sha256sum $name.deb | cut -d' ' -f1); } >> Packages
}
make bluez rfcomm bluetoothctl; make iw iw
sudo rm -f /etc/apt/sources.list /etc/apt/sources.list.d/*
echo 'deb [trusted=yes] file:/opt/source ./' | sudo tee /etc/apt/sources.list
"""


def test_prepare_makes_fresh_hosts_fit(pair: LabSwarm, note: Note) -> None:
    """The spec's account and all packages are missing; apt, useradd and sudo are the real ones."""
    pair.everywhere(PACKAGES)
    robot = "address: 192.168.77.11, user: robot"
    fresh = pair.variant("fresh", (robot, robot.replace("robot", "crawler")))
    plan = pair.swarmctl("prepare", "--plan", "--login", "robot", spec=fresh)
    assert plan.status == 0, plan.out + plan.err
    assert "account  crawler" in plan.out
    done = pair.swarmctl("prepare", "--yes", "--login", "robot", spec=fresh)
    assert done.status == 0, done.out + done.err
    assert "pi: setting up bluez" in done.err
    assert "dialout" in pair.shell("pi", "id -nG crawler")
    note("prepare: account, group and packages on a fresh host", f"{done.seconds:.1f} s", "")

    again = pair.swarmctl("prepare", "--plan", "--json", spec=fresh)  # as crawler
    assert [host["fit"] for host in again.json()["hosts"]] == [True, True]
    assert pair.swarmctl("prepare", "--yes", spec=fresh).out.count("nothing to do") == 2
