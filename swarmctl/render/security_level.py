"""The seam to the levels of `security`: what each adds to the hosts of a swarm.

To add one, write a subclass of ``SecurityLevel`` and register an object of it (see ``swarmctl.plugins``).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar, cast

from swarmctl.plugins import SECURITY_LEVELS
from swarmctl.render.bundle import Part
from swarmctl.swarm.resolved import Host, Swarm


class SecurityLevel:
    """A level of `security`. This one adds nothing. Parts are pure: the same swarm gives the same bytes."""

    #: Whether hosts accept the packets of declared flows only; a ROS 1 master then has a guard.
    filters: ClassVar[bool] = False
    #: Whether ROS uses WireGuard, with addresses of the network `overlay`: a level of whole swarms.
    wireguard: ClassVar[bool] = False

    def parts(self, swarm: Swarm, host: Host) -> Iterable[Part]:
        """Returns what a host of an island with this level gets; its units start before those of ROS."""
        return ()

    def swarm_parts(self, swarm: Swarm, host: Host) -> Iterable[Part]:
        """Returns what each host of a swarm with this level gets after ``parts``, whatever its island has."""
        return ()

    def reachable(self, swarm: Swarm, host: Host) -> tuple[str, ...]:
        """Returns what systemd lets units of ``host`` exchange packets with: addresses; empty for all."""
        return ()

    def port_owner(self, host: Host) -> str:
        """Returns the account whose processes may have the ports of units; empty if any may."""
        return ""


OFF = SecurityLevel()


def level_of(name: str) -> SecurityLevel:
    """Returns the level that `security` names. Raises KeyError if it is not registered."""
    return cast(SecurityLevel, SECURITY_LEVELS.get(name))
