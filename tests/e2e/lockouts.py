"""Ways for a host to lock its operator out, each tied to a release: it comes with it and goes with it.

swarmctl writes neither firewalls nor sshd's files. A unit of the site does here, which looks at the release.
"""

from __future__ import annotations

import json
import re
import subprocess
import time
from dataclasses import dataclass

from swarmctl.lab import lab
from tests.e2e.lab_swarm import HOME, LabSwarm, namespace_of, quoted

UNIT = "site.service"
FIREWALL = "tcp dport 22 tcp flags & (syn | ack) == syn drop"
SSHD = "/etc/ssh/sshd_config.d"
RESTART = "systemctl restart ssh"
ADDRESS = "ip -o -4 address show dev wlan0 | awk '{print $4}'"


@dataclass(frozen=True)
class Lockout:
    """Shell commands of root that shut the operator out, and let it in again."""

    shut: str
    open: str


LOCKOUTS = {
    "firewall": Lockout(
        f"nft 'table inet site {{ chain input {{ type filter hook input priority 0; {FIREWALL}; }}; }}'",
        "nft delete table inet site",
    ),
    "port of sshd": Lockout(
        f"sed -i 's/^Port .*/Port 2222/' {SSHD}/lab.conf; {RESTART}",
        f"sed -i 's/^Port .*/Port 22/' {SSHD}/lab.conf; {RESTART}",
    ),
    "users of sshd": Lockout(
        f"echo AllowUsers nobody >{SSHD}/site.conf; {RESTART}", f"rm -f {SSHD}/site.conf; {RESTART}"
    ),
    "stopped sshd": Lockout("systemctl stop ssh", "systemctl start ssh"),
    "subnet": Lockout(
        f"right=$({ADDRESS}); ip address flush dev wlan0; ip address add 10.254.0.9/24 dev wlan0",
        '[ -z "$right" ] || { ip address flush dev wlan0; ip address add $right dev wlan0; }',
    ),
    "wlan": Lockout("ip link set wlan0 down", "ip link set wlan0 up"),
}
# It keeps the record of the change while that waits for its confirmation: nobody can ask the host then.
_SCRIPT = """#!/bin/sh
state=
while :; do
  case $(readlink {home}/current) in */{release}) new=shut ;; *) new=open ;; esac
  if [ "$new" != "$state" ]; then
    if [ $new = shut ]; then {shut}; else {open}; fi
    state=$new
    echo "$new $(cut -d' ' -f1 /proc/uptime)" >>/var/tmp/site.log
  fi
  record={home}/state/transaction.json
  if [ $state = shut ] && grep -q pending $record; then cp $record /var/tmp/site.json; fi
  sleep 0.1
done
"""


def install(swarm: LabSwarm, host: str, lockout: Lockout, release: str) -> None:
    """Has ``host`` lock its operator out as long as it has this release, also after a restart."""
    script = _SCRIPT.format(home=HOME, release=release, shut=lockout.shut, open=lockout.open)
    unit = "[Service]\nExecStart=/usr/local/sbin/site\n[Install]\nWantedBy=multi-user.target\n"
    swarm.shell(
        host,
        f"printf %s {quoted(script)} | sudo tee /usr/local/sbin/site; sudo chmod +x /usr/local/sbin/site;"
        f"printf %s {quoted(unit)} | sudo tee /etc/systemd/system/{UNIT}; sudo rm -f /var/tmp/site.*;"
        f"sudo systemctl daemon-reload; sudo systemctl enable --now {UNIT}",
    )


def uninstall(swarm: LabSwarm, host: str) -> None:
    swarm.shell(
        host,
        f"sudo systemctl disable --now {UNIT};"
        f"sudo rm -f /etc/systemd/system/{UNIT} /usr/local/sbin/site /var/tmp/site.*;"
        "sudo systemctl daemon-reload",
    )


def answers(swarm: LabSwarm, host: str) -> bool:
    """True if a new connection leads to a shell, within 3 s."""
    ssh, *rest = lab.ssh_argv(swarm.name, host, ["true"])
    argv = ["nsenter", f"--net={namespace_of(swarm)}", ssh, *rest]
    try:
        done = subprocess.run(argv, capture_output=True, stdin=subprocess.DEVNULL, check=False, timeout=3)
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


def boot_time() -> float:
    """s since the boot; all hosts of a lab share the machine's kernel."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)


def deadline(swarm: LabSwarm, host: str) -> float:
    """When the change had to be confirmed, in s since the boot."""
    record = json.loads(swarm.shell(host, "sudo cat /var/tmp/site.json"))
    return float(record["deadline"])


def turns(swarm: LabSwarm, host: str) -> list[str]:
    """How often the host has shut its operator out and let it in again, in order."""
    return re.findall("^[a-z]+", swarm.shell(host, "sudo cat /var/tmp/site.log"), re.MULTILINE)
