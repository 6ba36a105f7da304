"""The pinned public WireGuard keys of the hosts of a lab."""

from __future__ import annotations

from collections.abc import Mapping

from swarmctl.lab.paths import lab_paths
from swarmctl.spec import wireguard_keys


def keys_of(lab: str) -> Mapping[str, str]:
    """Returns the keys by host; none before `swarmctl trust` has pinned some."""
    try:
        return wireguard_keys.parse(lab_paths(lab).wireguard_keys.read_bytes())
    except FileNotFoundError:
        return {}
