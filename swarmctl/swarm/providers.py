"""Which multimaster provider joins the islands of a ROS distribution. Pure."""

from __future__ import annotations

from swarmctl.plugins import MIDDLEWARES, MULTIMASTERS
from swarmctl.spec.ros_model import Multimaster


def provider_name(settings: Multimaster | None, distro: str) -> str:
    """Returns the provider that ``settings`` name if it joins islands of ``distro``, else that of the
    middleware; empty if it has none."""
    named = settings and settings.provider
    return named if named and joins(named, distro) else MIDDLEWARES.get(distro).multimaster


def joins(provider: str, distro: str) -> bool:
    """Returns True if ``provider`` joins islands of ``distro``."""
    needs = MULTIMASTERS.get(provider).needs
    return needs is None or needs in MIDDLEWARES.get(distro).capabilities
