"""The addresses in ROS variables, also where their form is one that ROS refuses."""

from __future__ import annotations

from dataclasses import replace
from urllib.parse import urlsplit

from swarmctl.importing.draft import Value
from swarmctl.importing.secret_names import is_secret
from swarmctl.swarm.addresses import ip_of

ROS_PORT = 11311


def own_address(value: Value) -> Value:
    """Returns a ROS_IP or ROS_HOSTNAME as a name or an address, also of one that is a URL or has a port."""
    text = str(value.value)
    if ip_of(text) or not set(text) & {":", "/"}:
        return value
    host, _ = _server_of(text)
    return _corrected(value, host, host) if host else value


def master_of(uri: Value) -> tuple[Value, int]:
    """Returns the host and the port of a ROS_MASTER_URI, also a wrong one; no host for what is none."""
    text = str(uri.value)
    host, port = _server_of(text)
    needed = f"http://{f'[{host}]' if ':' in host else host}:{port or ROS_PORT}"
    is_right = not host or text.lower().removesuffix("/") == needed
    found = replace(uri, value=host) if is_right else _corrected(uri, host, needed)
    return found, port or ROS_PORT


def _corrected(value: Value, address: str, needed: str) -> Value:
    text = str(value.value)
    return replace(value, value=address, was="" if is_secret("", text) else text, needed=needed)


def _server_of(text: str) -> tuple[str, int | None]:
    """The host and the port of a URL, also of one without a scheme; no host for what is none."""
    try:
        parts = urlsplit(text if "://" in text else f"http://{text}")
        return parts.hostname or "", parts.port
    except ValueError:
        return "", None
