"""Where a node listens: at its own address, if it has one that this host has."""

from __future__ import annotations

import importlib
import sys
import types
from typing import Any

import pytest

ANY = "0.0.0.0"


@pytest.mark.parametrize(
    ("advertised", "ipv6", "listens"),
    [
        ("127.0.0.1", False, "127.0.0.1"),
        ("192.0.2.1", False, ANY),  # translated by a router, or not there yet
        ("k3-pi", False, ANY),
        (None, False, ANY),
        ("::1", True, ANY),
    ],
)
def test_a_node_listens_at_the_address_that_others_have(
    advertised: str | None, ipv6: bool, listens: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    network = module(
        get_address_override=lambda: advertised,
        use_ipv6=lambda: ipv6,
        get_bind_address=lambda _address=None: ANY,
    )
    server = {"ThreadingXMLRPCServer": object, "SilenceableXMLRPCRequestHandler": object}
    stand_ins = {
        "rosgraph": module(network=network, xmlrpc=module(**server)),
        "rosgraph.xmlrpc": module(**server),
        "rospy": module(),
        "rospy.impl": module(tcpros_base=module(TCPServer=object)),
        "rospy.impl.tcpros_base": module(TCPServer=object),
    }
    for name, one in stand_ins.items():
        monkeypatch.setitem(sys.modules, name, one)
    monkeypatch.delitem(sys.modules, "swarm_onboard.ros1.connections", raising=False)
    importlib.import_module("swarm_onboard.ros1.connections").bound()
    assert network.get_bind_address() == listens
    monkeypatch.delitem(sys.modules, "swarm_onboard.ros1.connections")


def module(**contents: Any) -> Any:
    made = types.ModuleType("stand_in")
    made.__dict__.update(contents)
    return made
