"""Both faces of ROS."""

from __future__ import annotations

import pytest


@pytest.fixture(params=["1", "2"], ids=["ros1", "ros2"])
def ros(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """The ROS that a node joins, by ROS_VERSION in its environment."""
    monkeypatch.setenv("ROS_VERSION", request.param)
    return str(request.param)
