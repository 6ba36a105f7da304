"""What can be wrong with any node, in words: it is absent or dead, or another host has its name. Pure."""

from __future__ import annotations

from urllib.parse import urlsplit

from swarm_onboard.agent.observations import NodeSeen

from swarmctl.health.expected_graph import ExpectedHost


def unchecked(node: str, seen: NodeSeen | None) -> str:
    """Returns the text for a node on which the master did not answer."""
    return f"{node} was not checked" + (f": {seen.error}" if seen is not None and seen.error else "")


def absent(host: ExpectedHost) -> str:
    """Returns the text for a node of ``host`` that the graph does not have."""
    return "is not registered at the master" if host.master_uri else "is not in the graph"


def dead(host: ExpectedHost, seen: NodeSeen) -> str:
    """Returns the text for a node of ``host`` that the graph has, but that is not alive."""
    silent = f"does not answer ({seen.error})"
    return f"is registered, but {silent}" if host.master_uri else silent


def moved(host: ExpectedHost, seen: NodeSeen) -> str:
    """The text for a node that advertises another address than ``host``; empty if it does not.

    Nodes of a middleware whose probe reports no URIs advertise nothing.
    """
    if seen.uri and (advertised := host_of(seen.uri)) != host.advertised.lower():
        return f"advertises {advertised} instead of {host.advertised}"
    return ""


def host_of(uri: str) -> str:
    """Returns the host in a node's URI, or the whole text if it is not a URI."""
    try:
        return urlsplit(uri).hostname or uri
    except ValueError:
        return uri
