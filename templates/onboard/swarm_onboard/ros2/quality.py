"""With which quality of service a topic is received from all of its publishers."""

from __future__ import annotations

from typing import Any, Sequence

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy


def quality_of(publishers: Sequence[Any], depth: int) -> QoSProfile:
    """Returns the profile of a subscription that each of ``publishers`` connects to.

    ``publishers``: what a node's ``get_publishers_info_by_topic`` returns. The profile is reliable if all of
    them are, and transient local if all of them are.
    """
    profile = QoSProfile(depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT)
    offered = [one.qos_profile for one in publishers]
    if offered and all(one.reliability == ReliabilityPolicy.RELIABLE for one in offered):
        profile.reliability = ReliabilityPolicy.RELIABLE
    if offered and all(one.durability == DurabilityPolicy.TRANSIENT_LOCAL for one in offered):
        profile.durability = DurabilityPolicy.TRANSIENT_LOCAL
    return profile
