"""Recovery: whatever ends or is cut off, a swarm with one master is whole again without a person."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.e2e.lab_swarm import LabSwarm
from tests.e2e.recovery import HUB, KILLED, LINK, SPECS, deployed, lab_of_isles, recovers
from tests.timing import Promise

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("mode", ["leader", "central"])
def test_the_swarm_is_whole_again_by_itself(isles: LabSwarm, mode: str, promise: Promise) -> None:
    recovers(isles, deployed(isles, mode, SPECS[mode]), mode, (KILLED, HUB, LINK), promise)


def test_a_single_minded_swarm_is_whole_again_by_itself(workplace: Path, promise: Promise) -> None:
    """One host has it all: no link can be cut, and there is no peer."""
    mode = "single-minded"
    with lab_of_isles(workplace, mode) as swarm:
        recovers(swarm, deployed(swarm, mode, SPECS[mode]), mode, (KILLED, HUB), promise)
