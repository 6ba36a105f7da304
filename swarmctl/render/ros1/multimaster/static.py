"""Provider `static`: masters joined by swarmctl's own node, which has its peers from the spec.

It needs no ROS library, fetches the topics that its own island receives, and waits for masters by itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from swarmctl.render import shipped_files
from swarmctl.render.bundle import File, Part, Unit
from swarmctl.render.middleware import Capability
from swarmctl.render.multimaster import MultimasterProvider, OneNode
from swarmctl.render.quoting import render
from swarmctl.render.ros1 import release
from swarmctl.render.service_values import service_values
from swarmctl.render.yaml_params import params_file
from swarmctl.swarm import names
from swarmctl.swarm.resolved import Host, Island, Swarm

PARAMS = "params/multimaster.yaml"

_POLL_HZ = 1.0  # masters report new nodes at once; polling recovers reports that were lost
_SILENT_AFTER = 3.0  # s
_REMOVE_AFTER = 60.0  # s; shorter, and a robot behind a wall loses its publishers


class Static(OneNode):
    """The provider: one node on each hub that receives topics."""

    needs: Capability = "master"
    memory_mb = 60
    relays = False

    def parts(self, swarm: Swarm, host: Host, island: Island) -> Iterator[Part]:
        """Yields the node, its parameters and its unit."""
        params = File(PARAMS, params_file(_parameters(swarm, host, island)), origin="multimaster")
        files = (params, *shipped_files.folder("multimaster"))
        yield Part(files)
        yield _unit(swarm, host, files)


STATIC: MultimasterProvider = Static()


def _unit(swarm: Swarm, host: Host, files: tuple[File, ...]) -> Part:
    name = names.unit(swarm.name, names.MULTIMASTER)
    text = render("static.service", **service_values(swarm, host), params=PARAMS)
    file = File(f"units/{name}", text, origin="multimaster")
    return Part((file,), (Unit(name, (file.path, release.RESTART_DELAY, *(one.path for one in files))),))


def _parameters(swarm: Swarm, host: Host, island: Island) -> dict[str, Any]:
    """What the node reads: its peers, and the topics to bridge from each."""
    islands = {one.name: one for one in swarm.islands}
    return {
        "island": island.name,
        "node": names.multimaster_node(island.name),
        "master": swarm.master_uri(island),
        "address": host.advertised,
        "poll_hz": _POLL_HZ,
        "silent_after": _SILENT_AFTER,
        "remove_after": _REMOVE_AFTER,
        "peers": [
            {
                "island": peer,
                "master": swarm.master_uri(islands[peer]),
                "hosts": list(swarm.uri_hosts_of(islands[peer])),
                "receives": _listed(incoming),
                "sends": _listed(swarm.received.get(peer, {}).get(island.name, {})),
            }
            for peer, incoming in swarm.received[island.name].items()
            if islands[peer].has_master
        ],
    }


def _listed(topics: Mapping[str, str]) -> list[dict[str, str]]:
    return [{"topic": topic, "type": kind} for topic, kind in topics.items()]
