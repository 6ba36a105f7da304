"""Recovery: whatever ends or is cut off, a swarm with several masters is whole again without a person."""

from __future__ import annotations

import pytest

from tests.e2e.lab_swarm import LabSwarm
from tests.e2e.recovery import ENDED, HUB, KILLED, LINK, PEER, SPECS, deployed, recovers
from tests.timing import Promise

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("mode", ["standalone", "combined"])
def test_the_swarm_is_whole_again_by_itself(isles: LabSwarm, mode: str, promise: Promise) -> None:
    ended = (ENDED,) if mode == "standalone" else ()  # the bridge is the same in both
    recovers(isles, deployed(isles, mode, SPECS[mode]), mode, (KILLED, *ended, HUB, LINK, PEER), promise)
