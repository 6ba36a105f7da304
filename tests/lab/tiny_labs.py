"""Labs booted for a test, and what must be gone when they are down."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from swarmctl.lab import lab, paths, preparation, supervisor_client
from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import network, processes
from swarmctl.lab.lab_plan import LabPlan
from swarmctl.lab.paths import LabPaths
from tests.timing import PATIENCE, wait_for

SWARMCTL = Path(sys.executable).with_name("swarmctl")
TOOLS = ("ip", "mmdebstrap", "mount", "setpriv", "ssh", "ssh-keygen", "systemd-nspawn", "unshare")


def _missing() -> str:
    try:
        processes.require(*TOOLS)
    except LabError as error:
        return f"no lab here: {error} ({'; '.join(error.help_lines)})"
    return ""


def in_a_lab(test: Callable[..., object]) -> Callable[..., object]:
    """Mark a test that boots hosts: it is skipped where none can be booted."""
    return pytest.mark.lab(pytest.mark.skipif(bool(_missing()), reason=_missing())(test))


def on(name: str, host: str, command: str, timeout: float = PATIENCE) -> str:
    """What ``command`` prints on ``host``, as the spec's user."""
    done = subprocess.run(
        ("nsenter", f"--net={lab.operator(name).namespace}", *lab.ssh_argv(name, host, [command])),
        capture_output=True, text=True, timeout=timeout, check=False, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    assert done.returncode == 0, f"{host}: {command}: {done.stderr}{done.stdout}"
    return done.stdout.strip()


def succeeds(name: str, host: str, command: str) -> bool:
    try:
        on(name, host, command)
    except AssertionError:
        return False
    return True


def state_of(name: str, host: str) -> str:
    found: str = next(one["state"] for one in lab.status(name)["hosts"] if one["name"] == host)
    return found


def boots_of(name: str, host: str) -> int:
    found: int = next(one["boots"] for one in lab.status(name)["hosts"] if one["name"] == host)
    return found


def reach(name: str, host: str, address: str) -> None:
    """Waits until ``host`` reaches ``address``, after its neighbour cache has expired."""
    wait_for(
        lambda: succeeds(name, host, f"ping -c1 -W1 {address}"), complaint=f"{host} never receives {address}"
    )


def quiet(_: str) -> None:
    pass


@contextmanager
def booted(plan: LabPlan) -> Iterator[str]:
    """A lab that is up, down again on leaving."""
    try:
        lab.up(plan, quiet)
        yield plan.name
    finally:
        lab.down(plan.name)


def left_of(place: LabPaths) -> list[str]:
    """Everything of a lab that is still on this machine."""
    inside = str(place.directory)
    found = [f"namespace {name}" for name in place.namespaces()]
    found += [f"process {pid}" for pid in supervisor_client.pids(place)]
    found += [
        f"mount {line}" for line in Path("/proc/self/mountinfo").read_text().splitlines() if inside in line
    ]
    found += [f"cgroup {path}" for path in preparation.cgroups(place).all if path.exists()]
    found += [f"file {path}" for path in (place.directory, *place.directory.rglob("*")) if path.exists()]
    return found


def machine() -> dict[str, str]:
    """What no lab may change of the machine itself: its interfaces, addresses, routes and mounts."""
    commands = {
        "addresses": "ip -br address",
        "routes": "ip route",
        "rules": "ip rule",
        "firewall": "iptables-save",
    }
    found = {what: _output(command) for what, command in commands.items()}
    mounts = Path("/proc/self/mountinfo").read_text().splitlines()
    return {**found, "mounts": "\n".join(one for one in mounts if str(paths.NAMESPACES) not in one)}


def _output(command: str) -> str:
    try:
        return subprocess.run(command.split(), capture_output=True, text=True, check=False).stdout
    except FileNotFoundError:
        return ""


def processes_in(name: str) -> set[int]:
    place = paths.lab_paths(name)
    every = [network.namespace_path(place, host.name) for host in lab.read_state(place).plan.hosts]
    return set(processes.in_network_namespaces(every))
