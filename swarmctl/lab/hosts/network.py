"""The networks of a lab: one namespace per host, one bridge per link, all bridges in the operator's
namespace.

The machine's own namespace stays untouched: no address collides with it and no packet leaves the lab.
"""

from __future__ import annotations

import ctypes
import json
import os
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts.processes import run
from swarmctl.lab.paths import NAMESPACES, LabPaths

if TYPE_CHECKING:
    from swarmctl.lab.lab_plan import LabHost, LabPlan

CLONE_NEWNET = 0x40000000

Result = TypeVar("Result")


@dataclass(frozen=True)
class Batch:
    """Lines for ``ip -batch`` in a namespace; in the machine's own if ``namespace`` is None."""

    namespace: str | None
    lines: tuple[str, ...]

    @property
    def argv(self) -> tuple[str, ...]:
        """The ``ip`` command that reads the batch from stdin."""
        inside = () if self.namespace is None else ("-n", self.namespace)
        return ("ip", *inside, "-batch", "-")


def port(plan: LabPlan, host: str, network: str) -> str:
    """Returns the device name of the operator's end of the cable from ``network`` to ``host``."""
    return f"h{_index(plan.hosts, host)}n{_index(plan.networks, network)}"


def bridge(plan: LabPlan, network: str) -> str:
    """Returns the device name of the bridge of ``network``."""
    return f"br{_index(plan.networks, network)}"


def _index(things: tuple[object, ...], name: str) -> int:
    return [getattr(thing, "name", None) for thing in things].index(name)


def batches(plan: LabPlan, files: LabPaths) -> Iterator[Batch]:
    """Yields all ``ip`` commands that create the networks of ``plan``, in order."""
    operator = files.namespace()
    everyone = [operator, *(files.namespace(host.name) for host in plan.hosts)]
    yield Batch(None, tuple(f"netns add {name}" for name in everyone))
    yield Batch(operator, tuple(_operator_lines(plan, files)))
    for host in plan.hosts:
        yield Batch(files.namespace(host.name), tuple(_host_lines(host)))


def _operator_lines(plan: LabPlan, files: LabPaths) -> Iterator[str]:
    yield "link set lo up"
    for network in plan.networks:
        name = bridge(plan, network.name)
        yield f"link add {name} type bridge forward_delay 0 mcast_snooping 0"
        yield _address_line(network.operator, name)
        yield f"link set {name} up"
    multicast = {network.name: network.multicast for network in plan.networks}
    for host in plan.hosts:
        for interface in host.interfaces:
            cable = port(plan, host.name, interface.network)
            yield f"link add {cable} type veth peer name {interface.name} netns {files.namespace(host.name)}"
            yield f"link set {cable} master {bridge(plan, interface.network)} up"
            if not multicast[interface.network]:
                yield f"link set {cable} type bridge_slave mcast_flood off"


def _host_lines(host: LabHost) -> Iterator[str]:
    yield "link set lo up"
    for interface in host.interfaces:
        yield _address_line(interface.address, interface.name)
        yield f"link set {interface.name} up"


def _address_line(address: str, device: str) -> str:
    """IPv6 without duplicate address detection (nodad): the plan has checked that addresses are unique."""
    return f"address add {address} dev {device}" + (" nodad" if ":" in address else "")


def power_lines(host: LabHost, *, on: bool) -> tuple[str, ...]:
    """Returns the ``ip`` commands in a host's namespace for power on or off.

    The namespace outlives the host, and a host that is off must not answer pings. IPv6 addresses are lost
    when a link goes down, so all addresses are set again.
    """
    if not on:
        return tuple(f"link set {interface.name} down" for interface in host.interfaces)
    return tuple(line.replace("address add", "address replace") for line in _host_lines(host))


def set_power(host: LabHost, namespace: str, *, on: bool) -> None:
    """Runs ``power_lines``. Raises ``LabError`` if it fails."""
    run(Batch(namespace, ()).argv, "\n".join(power_lines(host, on=on)))


def create(plan: LabPlan, files: LabPaths) -> None:
    """Creates all namespaces and networks. Raises ``LabError`` if it fails."""
    for batch in batches(plan, files):
        run(batch.argv, "\n".join(batch.lines))


def remove(files: LabPaths) -> None:
    """Deletes all namespaces of the lab and the devices in them."""
    if names := files.namespaces():
        run(Batch(None, ()).argv, "\n".join(f"netns delete {name}" for name in names))


def set_cable(
    plan: LabPlan, files: LabPaths, host: str, *, up: bool, network: str | None = None
) -> tuple[str, ...]:
    """Connects or disconnects all cables of ``host``, or the one to ``network``. Returns these networks.

    Raises ``LabError``.
    """
    attached = tuple(interface.network for interface in plan.host(host).interfaces)
    if network is not None and network not in attached:
        raise LabError(f"host {host} is not on a network `{network}`", f"it is on {', '.join(attached)}")
    concerned = attached if network is None else (network,)
    lines = [f"link set {port(plan, host, name)} {'up' if up else 'down'}" for name in concerned]
    run(Batch(files.namespace(), ()).argv, "\n".join(lines))
    return concerned


def link_states(plan: LabPlan, files: LabPaths) -> dict[tuple[str, str], bool]:
    """Returns by ``(host, network)`` whether the cable is connected."""
    links = json.loads(run(("ip", "-n", files.namespace(), "-json", "link", "show")))
    connected = {link["ifname"] for link in links if "UP" in link["flags"]}
    return {
        (host.name, interface.network): port(plan, host.name, interface.network) in connected
        for host in plan.hosts
        for interface in host.interfaces
    }


def enter(namespace: Path) -> None:
    """Moves the calling thread, and what it starts from now on, into a network namespace.

    Raises ``LabError``.
    """
    libc = ctypes.CDLL(None, use_errno=True)  # os.setns needs Python 3.12
    try:
        descriptor = os.open(namespace, os.O_RDONLY | os.O_CLOEXEC)
    except FileNotFoundError:
        raise LabError(f"there is no network namespace {namespace}", "run `swarmctl lab up` first") from None
    try:
        if libc.setns(descriptor, CLONE_NEWNET) != 0:
            raise LabError(f"cannot enter {namespace}: {os.strerror(ctypes.get_errno())}", "run it as root")
    finally:
        os.close(descriptor)


def within(namespace: Path, function: Callable[[], Result]) -> Result:
    """Returns the result of ``function``, called in a network namespace by a thread of its own."""
    outcome: Future[Result] = Future()

    def body() -> None:
        try:
            enter(namespace)
            outcome.set_result(function())
        except BaseException as error:  # noqa: BLE001  (it is raised again in the caller)
            outcome.set_exception(error)

    thread = threading.Thread(target=body, daemon=True)
    thread.start()
    return outcome.result()


def namespace_path(files: LabPaths, host: str | None = None) -> Path:
    """Returns the namespace file of a host, or of the operator without one."""
    return NAMESPACES / files.namespace(host)
