"""The parameter file of the relay: what swarmctl writes is read; what loops or cannot be is refused."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import pytest
from swarm_onboard.domain_relay.config import Crossing, parse

DATA: dict[str, Any] = {
    "island": "k3-pi",
    "node": "/multimaster_k3_pi",
    "domain": 12,
    "peers": [
        {
            "island": "koala-laptop",
            "domain": 11,
            "receives": [
                {"topic": "/k3/cmd_vel", "type": "geometry_msgs/Twist", "command": True},
                {"topic": "/map", "type": "nav_msgs/OccupancyGrid"},
            ],
        }
    ],
}


def test_what_is_written_is_read() -> None:
    (peer,) = parse(DATA).peers
    assert peer.receives == (
        Crossing("/k3/cmd_vel", "geometry_msgs/Twist", command=True),
        Crossing("/map", "nav_msgs/OccupancyGrid", command=False),
    )


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda data: data["peers"][0].update(domain=12), "two islands have one domain"),
        (lambda data: data["peers"].append(data["peers"][0]), "two islands have one domain"),
        (lambda data: data.update(domain=233), "not a number from 0 to 232"),
        (lambda data: data.update(domain="12"), "not a number from 0 to 232"),
        (lambda data: data.update(node="multimaster"), "not a valid ROS name"),
        (lambda data: data["peers"][0]["receives"][0].update(type="os"), "not a valid ROS name or type"),
    ],
)
def test_a_wrong_file_is_refused(change: Callable[[Any], None], complaint: str) -> None:
    data = copy.deepcopy(DATA)
    change(data)
    with pytest.raises(ValueError, match=complaint):
        parse(data)
