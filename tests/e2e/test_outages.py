"""Wi-Fi that comes and goes while swarmctl deploys."""

from __future__ import annotations

import sys

import pytest

from tests.e2e.lab_swarm import LabSwarm, Note
from tests.e2e.outages import STEPS
from tests.e2e.test_change import FASTER_K3, K3
from tests.timing import PATIENCE

OUTAGE = 3  # s


@pytest.mark.slow
def test_each_step_of_a_deploy_meets_3_s_without_network(swarm: LabSwarm, note: Note) -> None:
    faster = swarm.variant("faster-k3", (K3, FASTER_K3))
    options = ("--healthy-for", "0.5")
    begun = swarm.begin(
        "deploy",
        *options,
        spec=faster,
        through=(sys.executable, "-m", "tests.e2e.outages", swarm.name, "k3-pi", str(OUTAGE)),
    )
    report, progress = begun.communicate(timeout=4 * PATIENCE)
    assert begun.returncode == 0, report + progress
    assert "1 of 3 hosts changed" in report
    assert progress.splitlines()[-1] == ", ".join(STEPS), progress
    assert swarm.plan(faster).status == 0
