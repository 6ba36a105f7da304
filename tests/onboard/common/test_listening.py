"""Nodes without rospy listen at IPv4 and IPv6 addresses."""

from __future__ import annotations

import asyncio
import socket

import pytest
from swarm_onboard.common.slave import SlaveApi
from swarm_onboard.common.tcpros import Publication

SERVERS = {
    "slave API": SlaveApi,
    "publication": lambda: Publication("/node", "/topic", "std_msgs/String", "*"),
}


@pytest.mark.skipif(not socket.has_dualstack_ipv6(), reason="this machine has no IPv6")
@pytest.mark.parametrize("server", SERVERS)
@pytest.mark.parametrize("address", ["127.0.0.1", "::1"])
def test_it_listens_at_addresses_of_both_versions(server: str, address: str) -> None:
    async def connect() -> None:
        _, writer = await asyncio.open_connection(address, await SERVERS[server]().start())
        writer.close()

    asyncio.run(connect())
