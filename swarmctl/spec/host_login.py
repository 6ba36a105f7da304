"""How to log in to a host of a spec."""

from __future__ import annotations

from dataclasses import dataclass, field

USER, PORT = "robot", 22  # where a spec has none


@dataclass(frozen=True)
class HostLogin:
    """What a spec has about logging in to a host. ``declared``: those of `user` and `port` that it sets.

    ``address``: where others reach it; ``via``: the host to jump through.
    """

    name: str
    address: str
    user: str = USER
    port: int = PORT
    via: str | None = None
    declared: frozenset[str] = field(default=frozenset(), compare=False)
