"""What one concern (ROS, the multimaster, the operating system) adds to a host's bundle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from swarmctl.render.bundle import File, SecretForm, Unit


@dataclass(frozen=True)
class Part:
    """Files, units with their unit files in start order, and the rest as in ``Bundle``.

    ``requires`` and ``wants`` have by requirement the entries of the spec that need it: ``robots.k3``.
    """

    files: tuple[File, ...] = ()
    units: tuple[tuple[File, Unit], ...] = ()
    links: Mapping[str, str] = field(default_factory=dict)
    blocks: Mapping[str, str] = field(default_factory=dict)
    requires: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    wants: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    secrets: tuple[str, ...] = ()
    secret_forms: Mapping[str, SecretForm] = field(default_factory=dict)
    follows: str = ""
    platform: str = ""
    unbuilt: tuple[str, ...] = ()
