"""The pinned public WireGuard keys of the hosts of a lab."""

from __future__ import annotations

from swarmctl.lab.paths import lab_paths
from swarmctl.spec import wireguard_keys


def keys_of(lab: str) -> str:
    """Returns the lines of the keys; none before `swarmctl trust` has pinned some."""
    try:
        return wireguard_keys.text_of(lab_paths(lab).wireguard_keys.read_bytes())
    except FileNotFoundError:
        return ""
