"""Several masters, joined by the node that swarmctl ships: it knows its peers, and needs no ROS library.

It fetches what its own island hears. So it runs where something is heard, and waits for masters by itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from swarmctl.render import ros1, shipped
from swarmctl.render.bundle import File, Unit
from swarmctl.render.params import params_file
from swarmctl.render.templates import render
from swarmctl.topology import names
from swarmctl.topology.swarm import Host, Island, Swarm

PARAMS = "params/multimaster.yaml"

_POLL_HZ = 1.0  # a node that comes is pushed to it at once; this is for what gets lost
_SILENT_AFTER = 3.0  # s
_REMOVE_AFTER = 60.0  # s; shorter, and a robot behind a wall takes its publishers along


def files(swarm: Swarm, host: Host, island: Island) -> Iterator[File]:
    """The node and its parameters, where the island hears others."""
    if island.name in swarm.heard:
        yield File(PARAMS, params_file(parameters(swarm, host, island)), origin="multimaster")
        yield from shipped.folder("sync")


def unit(swarm: Swarm, host: Host, island: Island) -> tuple[File, Unit] | None:
    needs = [one.path for one in files(swarm, host, island)]
    if not needs:
        return None
    name = names.unit(swarm.name, names.MULTIMASTER)
    text = render("static.service", **ros1.service_values(swarm), params=PARAMS)
    file = File(f"units/{name}", text, origin="multimaster")
    return file, Unit(name, (file.path, *needs))


def parameters(swarm: Swarm, host: Host, island: Island) -> dict[str, Any]:
    """What the node reads: whom to ask, for which topics."""
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
                "hosts": list(swarm.places_of(islands[peer])),
                "hears": _listed(hears),
                "tells": _listed(swarm.heard.get(peer, {}).get(island.name, {})),
            }
            for peer, hears in swarm.heard[island.name].items()
        ],
    }


def _listed(topics: Mapping[str, str]) -> list[dict[str, str]]:
    return [{"topic": topic, "type": kind} for topic, kind in topics.items()]
