"""What units cost, read from hosts: a host that cannot be read costs only itself."""

from __future__ import annotations

from typing import Any

import pytest

from swarmctl.health.host_costs import HostCosts
from swarmctl.remote.transport import HostError, Kind, Target
from tests.timing import wait_for


@pytest.mark.parametrize(
    ("raised", "shown"),
    [
        (HostError(Kind.AUTH, "no key"), "no key"),
        (KeyError("x"), "pi: KeyError: 'x'; this is a bug in swarmctl"),
    ],
)
def test_an_error_and_a_bug_are_those_of_their_host(raised: Exception, shown: str) -> None:
    class Broken:
        def connect(self, target: Target) -> Any:
            raise raised

    costs = HostCosts("s", [Target("pi", "192.0.2.1", "robot")], Broken(), 1.0)  # type: ignore[arg-type]
    assert str(wait_for(costs.latest)["pi"]) == shown
