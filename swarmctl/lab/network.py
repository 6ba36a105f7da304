"""The networks of a lab: a namespace a host, a bridge a link, and the bridges in the operator's namespace.

Nothing of it stands in the machine's own namespace: no address collides with the machine's, no packet leaves.
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
from typing import TypeVar

from swarmctl.lab.errors import LabError
from swarmctl.lab.places import NAMESPACES, Home
from swarmctl.lab.plan import LabHost, LabPlan
from swarmctl.lab.processes import run

CLONE_NEWNET = 0x40000000

Result = TypeVar("Result")


@dataclass(frozen=True)
class Batch:
    """Lines for ``ip -batch`` in one namespace; in the machine's own when ``namespace`` is nothing."""

    namespace: str | None
    lines: tuple[str, ...]

    @property
    def argv(self) -> tuple[str, ...]:
        inside = () if self.namespace is None else ("-n", self.namespace)
        return ("ip", *inside, "-batch", "-")


def port(plan: LabPlan, host: str, network: str) -> str:
    """The operator's end of the cable from ``network`` to ``host``."""
    return f"h{_index(plan.hosts, host)}n{_index(plan.networks, network)}"


def bridge(plan: LabPlan, network: str) -> str:
    return f"br{_index(plan.networks, network)}"


def _index(things: tuple[object, ...], name: str) -> int:
    return [getattr(thing, "name", None) for thing in things].index(name)


def batches(plan: LabPlan, home: Home) -> Iterator[Batch]:
    """Everything ``ip`` has to do to build the networks of ``plan``, in order."""
    operator = home.namespace()
    everyone = [operator, *(home.namespace(host.name) for host in plan.hosts)]
    yield Batch(None, tuple(f"netns add {name}" for name in everyone))
    yield Batch(operator, tuple(_operator_lines(plan, home)))
    for host in plan.hosts:
        yield Batch(home.namespace(host.name), tuple(_host_lines(host)))


def _operator_lines(plan: LabPlan, home: Home) -> Iterator[str]:
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
            yield f"link add {cable} type veth peer name {interface.name} netns {home.namespace(host.name)}"
            yield f"link set {cable} master {bridge(plan, interface.network)} up"
            if not multicast[interface.network]:
                yield f"link set {cable} type bridge_slave mcast_flood off"


def _host_lines(host: LabHost) -> Iterator[str]:
    yield "link set lo up"
    for interface in host.interfaces:
        yield _address_line(interface.address, interface.name)
        yield f"link set {interface.name} up"


def _address_line(address: str, device: str) -> str:
    """An IPv6 address is usable at once: the plan has seen to it that nobody else has it."""
    return f"address add {address} dev {device}" + (" nodad" if ":" in address else "")


def power_lines(host: LabHost, *, on: bool) -> tuple[str, ...]:
    """What ``ip`` does in a host's namespace when the host goes on or off: the kernel there never dies, and a
    host that is off must not answer pings. IPv6 addresses are lost with the link, so all are given anew."""
    if not on:
        return tuple(f"link set {interface.name} down" for interface in host.interfaces)
    return tuple(line.replace("address add", "address replace") for line in _host_lines(host))


def set_power(host: LabHost, namespace: str, *, on: bool) -> None:
    run(Batch(namespace, ()).argv, "\n".join(power_lines(host, on=on)))


def create(plan: LabPlan, home: Home) -> None:
    for batch in batches(plan, home):
        run(batch.argv, "\n".join(batch.lines))


def remove(home: Home) -> None:
    """Drop all namespaces of the lab, and with them every device in them."""
    if names := home.namespaces():
        run(Batch(None, ()).argv, "\n".join(f"netns delete {name}" for name in names))


def set_cable(
    plan: LabPlan, home: Home, host: str, *, up: bool, network: str | None = None
) -> tuple[str, ...]:
    """Cut or join the cables of ``host``, or only the one to ``network``. Gives the networks concerned."""
    attached = tuple(interface.network for interface in plan.host(host).interfaces)
    if network is not None and network not in attached:
        raise LabError(f"host {host} is not on a network `{network}`", f"it is on {', '.join(attached)}")
    concerned = attached if network is None else (network,)
    lines = [f"link set {port(plan, host, name)} {'up' if up else 'down'}" for name in concerned]
    run(Batch(home.namespace(), ()).argv, "\n".join(lines))
    return concerned


def cables(plan: LabPlan, home: Home) -> dict[tuple[str, str], bool]:
    """Which cables, by ``(host, network)``, are whole."""
    links = json.loads(run(("ip", "-n", home.namespace(), "-json", "link", "show")))
    whole = {link["ifname"] for link in links if "UP" in link["flags"]}
    return {
        (host.name, interface.network): port(plan, host.name, interface.network) in whole
        for host in plan.hosts
        for interface in host.interfaces
    }


def enter(namespace: Path) -> None:
    """Move the calling thread, and all it starts from now on, into a network namespace, for good."""
    libc = ctypes.CDLL(None, use_errno=True)  # os.setns came with Python 3.12
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
    """Call ``function`` in a network namespace; the caller stays where it is."""
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


def namespace_path(home: Home, host: str | None = None) -> Path:
    return NAMESPACES / home.namespace(host)
