"""The system of each host: kernel, hardware, packages and its robots' firmwares, as the host knows them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from hashlib import sha256

from swarm_onboard.agent.verbs import system

from swarmctl.remote.ask import ask_each
from swarmctl.remote.parallel_hosts import results_of
from swarmctl.remote.transport import HostError, Target, Transport
from swarmctl.render.build_bundle import bundles
from swarmctl.swarm.resolved import Swarm

System = system.Answer
_MOST_DEVICES = 100  # of a host, and ports of a device
_DIGITS = 16  # of a hash


def systems(
    swarm: Swarm, targets: Mapping[str, Target], transport: Transport, *, parallel: int
) -> dict[str, System]:
    """Returns the system of each host that answers, without what was not requested."""
    made = bundles(swarm)
    requests = {host: system.Request(swarm.name, made[host].asks, _robots(swarm, host)) for host in targets}
    found = results_of(ask_each(system.handle, requests, targets, transport, parallel=parallel))
    answers = {host: one for host, one in found.items() if not isinstance(one, HostError)}
    return {host: _requested(one, requests[host]) for host, one in answers.items()}


def with_hashes(one: System) -> System:
    """Returns a system with a hash in place of each serial number: the same for the same number.

    A short number can be guessed from it.
    """
    return one._replace(devices=[device._replace(serial=_hashed(device.serial)) for device in one.devices])


def _hashed(serial: str) -> str:
    return f"sha256:{sha256(serial.encode()).hexdigest()[:_DIGITS]}" if serial else ""


def _robots(swarm: Swarm, host: str) -> dict[str, str]:
    own = {name: one.line for name, one in swarm.robots.items() if one.host == host}
    return {name: line.path if line else "" for name, line in own.items()}


def _requested(answer: System, request: system.Request) -> System:
    return answer._replace(
        devices=[one._replace(ports=one.ports[:_MOST_DEVICES]) for one in answer.devices[:_MOST_DEVICES]],
        packages=_of(answer.packages, {one.removeprefix("package:") for one in request.requires}),
        ports=_of(answer.ports, request.robots),
        firmware=_of(answer.firmware, request.robots),
    )


def _of(values: Mapping[str, str], names: Collection[str]) -> dict[str, str]:
    return {name: value for name, value in values.items() if name in names}
