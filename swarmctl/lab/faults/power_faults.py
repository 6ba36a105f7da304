"""Faults of a host's power: a reboot, a power cut."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

from swarmctl.lab.errors import LabError
from swarmctl.lab.faults.fault_kind import FaultKind, RunningLab

REBOOT_SCRIPT = "systemctl --no-block reboot"


def _reboot(lab: RunningLab, host: str, _: Any) -> str:
    boots = lab.hosts()[lab.plan.host(host).name]["boots"]
    lab.in_host(host, REBOOT_SCRIPT)
    _until(lambda: lab.hosts()[host]["boots"] > boots, f"host {host} does not reboot")
    return "boots again"


def power_off(lab: RunningLab, host: str, _: Any = None) -> str:
    """Cuts a host's power and waits until it has stopped. Its disk is kept. Raises ``LabError``."""
    lab.ask("kill", lab.plan.host(host).name)
    _until(lambda: lab.hosts()[host]["state"] == "stopped", f"host {host} does not stop")
    return "power off"


def power_on(lab: RunningLab, hosts: Sequence[str]) -> None:
    """Starts those hosts that are off, and waits until systemd runs on all. Raises ``LabError``."""
    state = lab.hosts()
    for host in hosts:
        if state[host]["state"] == "stopped":
            lab.ask("start", host)

    def run() -> bool:
        found = lab.hosts()
        return all(found[host]["state"] == "running" or not found[host]["wanted"] for host in hosts)

    _until(run, "a host does not start")


def _until(condition: Callable[[], bool], complaint: str) -> None:
    from swarmctl.lab.host_startup import BOOT_TIMEOUT  # noqa: PLC0415  (large)

    deadline = time.monotonic() + BOOT_TIMEOUT
    while not condition():
        if time.monotonic() > deadline:
            raise LabError(complaint)
        time.sleep(0.02)


REBOOT = FaultKind("reboot", "Reboot hosts.", _reboot, power_on)
POWER_OFF = FaultKind("power-off", "Cut the power of hosts; their disks stay.", power_off, power_on)
