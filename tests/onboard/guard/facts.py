"""The guard's parameters as swarmctl writes them, for an island on loopback addresses."""

from __future__ import annotations

from typing import Any

LAPTOP, K3, EPUCK, OTHER, STRANGER = (f"127.0.0.{number}" for number in range(2, 7))


def parameters(port: int) -> dict[str, Any]:
    """The island of a laptop with the robots `k3` and `epuck`; `other` is the hub of another island."""
    return {
        "hub": "laptop",
        "places": [LAPTOP],
        "port": port,
        "uri": f"http://{LAPTOP}:{port}",
        "use_sim_time": False,
        "hosts": {"laptop": [LAPTOP, "laptop"], "k3-pi": [K3, "k3-pi"], "epuck-pi": [EPUCK, "epuck-pi"]},
        "others": {"other": {"at": [OTHER, "other"], "receives": ["/k3/odom"], "sends": ["/far/scan"]}},
        "joined": [OTHER, "other"],
        "names": {
            "/rosout": ["laptop"],
            "/k3": ["k3-pi", "epuck-pi"],  # the program /k3/follow runs on epuck-pi
            "/k3/driver": ["k3-pi"],
            "/k3/follow": ["epuck-pi"],
            "/epuck": ["epuck-pi"],
        },
        "topics": {"/k3/odom": ["k3-pi"], "/k3/cmd_vel": ["laptop", "k3-pi"], "/far/odom": []},
    }
