"""A flow: who may reach which service of which hosts, and why. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum


class Service(str, Enum):
    """What a host offers to others; the values are for people."""

    MASTER = "ROS master"
    NODES = "ROS nodes"
    MULTIMASTER = "multimaster"
    CLOCK = "clock"
    SSH = "SSH"


_OF_ROS = (Service.MASTER, Service.NODES, Service.MULTIMASTER)


@dataclass(frozen=True)
class Flow:
    """Each of ``sources`` may reach ``service`` on each other one of ``hosts``; ``cause`` is why.

    Without sources everybody may.
    """

    sources: tuple[str, ...]
    hosts: tuple[str, ...]
    service: Service
    cause: str

    def to_json(self) -> dict[str, object]:
        """Returns the value as JSON data, as docs/graph.md describes it."""
        return {
            "from": list(self.sources),
            "service": self.service.value,
            "hosts": list(self.hosts),
            "cause": self.cause,
        }


def peers_of(flows: Iterable[Flow]) -> Mapping[str, frozenset[str]]:
    """Returns by host the others with which its units of ROS exchange packets, in either direction."""
    found: dict[str, set[str]] = {}
    for flow in flows:
        if flow.service in _OF_ROS:
            for host in flow.hosts:
                found.setdefault(host, set()).update(flow.sources)
            for source in flow.sources:
                found.setdefault(source, set()).update(flow.hosts)
    return {host: frozenset(peers - {host}) for host, peers in found.items()}
