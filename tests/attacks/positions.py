"""Where an attacker sits, and how it runs there."""

from __future__ import annotations

import json
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from swarmctl.lab import lab, paths
from swarmctl.lab.hosts import network
from tests.attacks.world import HOST
from tests.e2e.lab_swarm import LEADER, LabSwarm, namespace_of, quoted
from tests.e2e.ros_addresses import ros_addresses

INTRUDER = Path(__file__).with_name("intruder.py")
AWAY = "epuck-pi"  # cut off while another machine has its address; in d it is the host that is compromised
ACCOUNT = "mallory"
_COPY = "/var/tmp/intruder.py"
#: As a container without root is run in the host's network (user_namespaces(7)).
_ROOTLESS = ("unshare", "--user", "--map-root-user", "--mount", "--pid", "--fork", "--mount-proc")
_SCRIPT, _RESULT = "/var/tmp/intruder.sh", "/var/tmp/intruder.out"
_AT_BOOT = "/etc/systemd/system/intruder.service"

Argv = Callable[[LabSwarm, tuple[str, ...]], list[str]]


@dataclass(frozen=True)
class Position:
    """``host``: on which it is; None for a machine that the spec does not declare.

    ``address`` gives the one from which it attacks; ``taken`` surrounds its attacks.
    """

    key: str
    what: str
    host: str | None
    argv: Argv
    address: Callable[[LabSwarm], str]
    taken: Callable[[LabSwarm], AbstractContextManager[None]] = lambda _: nullcontext()

    def begin(self, swarm: LabSwarm, attack: str, facts: Mapping[str, Any]) -> subprocess.Popen[str]:
        """The attack under way; it prints what ``intruder.py`` says."""
        argv = self._argv(swarm, attack, facts)
        pipe, nothing = subprocess.PIPE, subprocess.DEVNULL
        return subprocess.Popen(argv, stdin=nothing, stdout=pipe, stderr=nothing, text=True)

    def _argv(self, swarm: LabSwarm, attack: str, facts: Mapping[str, Any]) -> list[str]:
        return self.argv(swarm, (attack, json.dumps({**facts, "own": self.address(swarm)})))

    @contextmanager
    def at_boot(self, swarm: LabSwarm, attack: str, facts: Mapping[str, Any]) -> Iterator[None]:
        """The attack begins at each boot of its host, as by `@reboot` of an account's crontab."""
        assert self.host is not None
        unit = f"[Service]\nExecStart=/bin/sh {_SCRIPT}\n[Install]\nWantedBy=multi-user.target\n"
        script = f"{self._argv(swarm, attack, facts)[-1]} >{_RESULT}.part; mv {_RESULT}.part {_RESULT}"
        write = f"rm -f {_RESULT}; printf %s {quoted(script)} >{_SCRIPT}"
        write += f"; printf %s {quoted(unit)} | sudo tee {_AT_BOOT} >/dev/null"
        swarm.shell(self.host, f"{write}; sudo systemctl enable intruder")
        try:
            yield
        finally:
            swarm.shell(self.host, f"sudo systemctl disable --now intruder; sudo rm {_AT_BOOT}")

    def result(self, swarm: LabSwarm) -> Mapping[str, Any]:
        """What the attack of a boot has printed at its end; empty before."""
        assert self.host is not None
        found = swarm.shell(self.host, f"cat {_RESULT} 2>/dev/null || true")
        return printed(found) if found else {}


def printed(out: str) -> Mapping[str, Any]:
    """What an attacker has printed at its end; it may have been killed before."""
    last = out.strip().rpartition("\n")[2]
    found: Mapping[str, Any] = json.loads(last) if last.startswith("{") else {"error": "it was killed"}
    return found


def _outside(swarm: LabSwarm, arguments: tuple[str, ...]) -> list[str]:
    return ["nsenter", f"--net={namespace_of(swarm)}", sys.executable, str(INTRUDER), *arguments]


def _on(host: str, account: str, *before: str) -> Argv:
    def argv(swarm: LabSwarm, arguments: tuple[str, ...]) -> list[str]:
        words = shlex.join((*before, "python3", _COPY, *arguments))
        return swarm.shell_argv(host, f"sudo -u {account} {words}")

    return argv


def _own_of(host: str) -> Callable[[LabSwarm], str]:
    return lambda swarm: ros_addresses(swarm)[host]


def _foreign(swarm: LabSwarm) -> str:
    """The address that the lab's operator has on the wlan."""
    return str(lab.status(swarm.name)["networks"][0]["operator"]).partition("/")[0]


@contextmanager
def _routes(swarm: LabSwarm) -> Iterator[None]:
    """The machine outside sends to the addresses of ROS, whichever they are, on the wlan."""
    routes = [f"{one}/32" for one in ros_addresses(swarm).values() if one not in swarm.hosts.values()]
    for one in routes:
        _ip(swarm, None, f"route add {one} dev br0")
    try:
        yield
    finally:
        for one in routes:
            _ip(swarm, None, f"route delete {one} dev br0")


@contextmanager
def _address_taken(swarm: LabSwarm) -> Iterator[None]:
    """``AWAY`` is cut off the network, and the machine outside has its addresses."""
    addresses = dict.fromkeys((f"{swarm.hosts[AWAY]}/24", f"{ros_addresses(swarm)[AWAY]}/24"))
    with _routes(swarm):
        swarm.cut(AWAY)
        for one in addresses:
            _ip(swarm, None, f"address add {one} dev br0")
        _forget_neighbours(swarm)
        try:
            yield
        finally:
            for one in addresses:
                _ip(swarm, None, f"address delete {one} dev br0")
            swarm.join(AWAY)
            _forget_neighbours(swarm)


def _forget_neighbours(swarm: LabSwarm) -> None:
    for host in (None, *swarm.hosts):
        _ip(swarm, host, "neighbour flush all")


def _ip(swarm: LabSwarm, host: str | None, command: str) -> None:
    namespace = network.namespace_path(paths.lab_paths(swarm.name), host)
    subprocess.run(["ip", "-n", namespace.name, *command.split()], check=True, capture_output=True)


POSITIONS = (
    Position("a", "a foreign machine on the wlan", None, _outside, _foreign, _routes),
    Position("b", f"one with the address of {AWAY}, cut off", None, _outside, _own_of(AWAY), _address_taken),
    Position("c1", f"an account on {HOST}", HOST, _on(HOST, ACCOUNT), _own_of(HOST)),
    Position("c2", f"an account on {LEADER}", LEADER, _on(LEADER, ACCOUNT), _own_of(LEADER)),
    Position(
        "c3",
        "a container of that account",
        LEADER,
        _on(LEADER, ACCOUNT, *_ROOTLESS),
        _own_of(LEADER),
    ),
    Position("d", f"root on {AWAY}", AWAY, _on(AWAY, "root"), _own_of(AWAY)),
)


def prepare(swarm: LabSwarm) -> None:
    """Each host gets an account without rights, and the program of the attacker."""
    text = quoted(INTRUDER.read_text("utf-8"))
    swarm.everywhere(
        f"id {ACCOUNT} >/dev/null 2>&1 || sudo useradd --create-home {ACCOUNT}; printf %s {text} >{_COPY}"
    )
