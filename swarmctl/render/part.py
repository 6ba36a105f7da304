"""What one concern (ROS, the multimaster, the operating system) adds to a host's bundle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from swarmctl.render.bundle import File, Unit


@dataclass(frozen=True)
class Part:
    """Files, units with their unit files in start order, and the rest as in ``Bundle``."""

    files: tuple[File, ...] = ()
    units: tuple[tuple[File, Unit], ...] = ()
    links: Mapping[str, str] = field(default_factory=dict)
    blocks: Mapping[str, str] = field(default_factory=dict)
    requires: tuple[str, ...] = ()
    wants: tuple[str, ...] = ()
    secrets: tuple[str, ...] = ()
    follows: str = ""
