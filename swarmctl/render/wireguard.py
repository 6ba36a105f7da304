"""The WireGuard of a host of a sealed swarm: its peers, and the unit that makes the interface. Pure.

The peers of a host are those that its units exchange packets with. Each has one address, so that a packet's
source proves the key of its sender; one that relays has those of the hosts behind it, too. Keys are no part
of a release: the host keeps those that it knows, so that a rollback brings back none that was retired.
Sources: wg(8); Donenfeld, "WireGuard" (NDSS 2017), 2: cryptokey routing.
"""

from __future__ import annotations

import json
from collections.abc import Iterator

from swarm_onboard.tunnel.keys import lines_of
from swarm_onboard.tunnel.peers import PEERS

from swarmctl.render import shipped_files
from swarmctl.render.bundle import File, Part, Unit
from swarmctl.render.firewall import Filtered
from swarmctl.render.quoting import render
from swarmctl.render.security_level import SecurityLevel
from swarmctl.render.service_values import service_values
from swarmctl.swarm import names
from swarmctl.swarm.addresses import bracketed, subnet_of
from swarmctl.swarm.resolved import Host, Swarm
from swarmctl.swarm.wireguard_routes import ends_of, routes_of

PORT = 51820
#: Bytes, the least of IPv6. With 60 of WireGuard they reach a host whose own network carries 1400.
MTU = 1280
_RESTART_DELAY = "bin/restart-delay"


class Sealed(Filtered):
    """The level `sealed`: beside what `filtered` has, WireGuard between all hosts of the swarm."""

    wireguard = True

    def swarm_parts(self, swarm: Swarm, host: Host) -> Iterator[Part]:
        """Yields the peers and the unit of WireGuard."""
        yield _part(swarm, host)


SEALED: SecurityLevel = Sealed()


def _part(swarm: Swarm, host: Host) -> Part:
    routes = routes_of(swarm, host.name)
    listed = [
        {
            "name": name,
            "addresses": [swarm.hosts[one].ros_address for one in (name, *behind)],
            "endpoint": bracketed(swarm.hosts[name].address),
        }
        for name, behind in routes.items()
    ]
    text = json.dumps({"port": PORT, "peers": listed}, indent=1) + "\n"
    name = names.unit(swarm.name, names.WIREGUARD)
    unit = render(
        "wireguard.service",
        **service_values(swarm, host),
        interface=names.wireguard_interface(swarm.name),
        address=f"{host.ros_address}/{subnet_of(swarm.overlay).prefixlen}",
        mtu=MTU,
        relays=bool(ends_of(swarm, host.name)),
        peers=PEERS,
        runtime=names.runtime_folder(swarm.name, names.WIREGUARD),
    )
    program = (
        File(f"units/{name}", unit, origin="security"),
        *shipped_files.folder("tunnel"),
        File(_RESTART_DELAY, shipped_files.text("os/restart-delay"), 0o755),
    )
    return Part(
        # It reads other peers while it runs: a host that joins interrupts no other.
        (File(PEERS, text.encode(), origin="security"), *program),
        (Unit(name, tuple(file.path for file in program)),),
        requires={"wg": ("security",)},
        wireguard_keys=lines_of(swarm.wireguard_keys, (host.name, *routes)),
        unpinned=tuple(
            one for one in (host.name, *routes) if one not in {*swarm.keys.live, *swarm.keys.expelled}
        ),
    )
