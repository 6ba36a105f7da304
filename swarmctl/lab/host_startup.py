"""Waiting until the hosts of a lab answer SSH."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable
from ipaddress import ip_address, ip_interface

from swarmctl.lab import supervisor_client
from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import network
from swarmctl.lab.lab_plan import LabHost, LabPlan
from swarmctl.lab.lab_state import read_state
from swarmctl.lab.paths import LabPaths, last_lines
from swarmctl.yamltext import hostlist

BOOT_TIMEOUT = 90.0  # s
PAUSE = 1.0  # s between two lines


def wait_for_hosts(files: LabPaths, plan: LabPlan, progress: Callable[[str], None], *, since: float) -> None:
    """Waits until the systemd and the sshd of every host run; ``progress`` gets at most one line a second.

    ``since`` is the start of the displayed time (``time.monotonic``). Raises ``LabError`` if a host fails.
    """
    waiting = {host.name: host for host in plan.hosts}
    cut_off = _cut_off(files)
    answered: list[str] = []
    noted = since
    while waiting:
        report = supervisor_client.running(files)["hosts"]
        for host in [host for name, host in waiting.items() if report[name]["state"] == "running"]:
            if host.name in cut_off:
                del waiting[host.name]
                progress(f"host {host.name}: running, but its network is cut")
            elif _answers_ssh(files, host):
                del waiting[host.name]
                answered.append(host.name)
        if answered and (not waiting or time.monotonic() - noted > PAUSE):
            listed = hostlist.written(host.name for host in plan.hosts if host.name in answered)
            progress(f"SSH answers on {listed}  {time.monotonic() - since:.1f} s")
            answered, noted = [], time.monotonic()
        for host in waiting.values():
            if not report[host.name]["wanted"]:
                output = last_lines(files.host(host.name).log)
                raise LabError(
                    f"host {host.name} did not start: exit status {report[host.name]['exit']}", *output
                )
        if waiting and time.monotonic() - since > BOOT_TIMEOUT:
            raise LabError(f"no SSH answer after {BOOT_TIMEOUT:.0f} s from: {', '.join(waiting)}")
        if waiting:
            time.sleep(0.05)


def _cut_off(files: LabPaths) -> set[str]:
    """Returns the hosts whose network of their address was disconnected by ``cut``."""
    plan = read_state(files).plan
    connected = network.link_states(plan, files)
    return {
        host.name
        for host in plan.hosts
        for interface in host.interfaces
        if ip_interface(interface.address).ip == ip_address(host.address)
        and not connected[host.name, interface.network]
    }


def _answers_ssh(files: LabPaths, host: LabHost) -> bool:
    def banner() -> bytes:
        with socket.create_connection((host.address, host.port), timeout=1.0) as connection:
            return connection.recv(4)

    try:
        return network.within(network.namespace_path(files), banner) == b"SSH-"
    except OSError:
        return False
