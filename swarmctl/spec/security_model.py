"""The level of `security` of a swarm, and that of an island, as the spec has them."""

from __future__ import annotations

from typing import Annotated

from swarmctl.plugins import SECURITY_LEVELS, NameIn


class _OfIslands:
    """The levels that an island can have of its own: WireGuard is between all hosts of a swarm."""

    def names(self) -> tuple[str, ...]:
        return tuple(name for name in SECURITY_LEVELS if name in self)

    def __contains__(self, name: object) -> bool:
        return name in SECURITY_LEVELS and not has_wireguard(str(name))


def has_wireguard(level: str) -> bool:
    """Returns True if ROS uses WireGuard in a swarm with this level."""
    return bool(SECURITY_LEVELS.get(level).wireguard)


Security = Annotated[str, NameIn(SECURITY_LEVELS)]
IslandSecurity = Annotated[str, NameIn(_OfIslands())]
