"""A robot with an empty battery stands, and no trial begins with a low one."""

from __future__ import annotations

import re
from pathlib import Path

from swarmctl.cli import exit_codes
from swarmctl.lab import lab
from tests.e2e.lab_swarm import LabSwarm, moves, until
from tests.e2e.test_experiments import CONTROL, EXPERIMENT, drive
from tests.timing import PATIENCE


def test_no_trial_begins_with_a_low_battery(swarm: LabSwarm, tmp_path: Path) -> None:
    spec = limited(swarm, EXPERIMENT % 15)
    until(lambda: ready(swarm, spec), "the swarm is not ready")
    running = swarm.begin("run", "ahead", "--out", str(tmp_path), spec=spec)
    until(lambda: drive(swarm), "the trial does not begin")
    lab.fault(swarm.name, "battery", "k3", 30.0)
    try:
        out, err = running.communicate(timeout=PATIENCE)
    finally:
        lab.fault(swarm.name, "battery", "k3", 80.0)
    assert "trial 1  completed" in out
    assert running.returncode == exit_codes.UNHEALTHY
    assert re.search(r"trial 2 did not begin: batteries: k3 \d+% \(less than 40%\)", err), err
    until(lambda: ready(swarm, spec), "the swarm is not ready again")


def test_a_robot_with_an_empty_battery_stands_until_it_is_charged(swarm: LabSwarm) -> None:
    spec = limited(swarm, "")

    def driven() -> bool:
        return moves(swarm.robots()["k3"])

    with swarm.driving("koala-laptop", "k3", 0.05):
        until(driven, "it does not drive")
        lab.fault(swarm.name, "battery", "k3", 5.0)
        try:
            until(lambda: not driven(), "it drives on")
            until(lambda: "report k3" in swarm.findings(spec=spec), "status does not name it")
            found = swarm.findings(spec=spec)["report k3"]
            assert re.search(r"battery empty: \d+%, takes no command until 40%", found["message"]), found
            refused = swarm.swarmctl("ready", spec=spec)
            assert refused.status == exit_codes.UNHEALTHY
            assert re.search(r"batteries +NO-GO +k3 \d+% \(less than 40%\)", refused.out), refused.out
            assert not driven(), "whoever commands it"
        finally:
            lab.fault(swarm.name, "battery", "k3", 50.0)
        until(driven, "it takes no command with a charged battery")
    until(lambda: ready(swarm, spec), "the swarm is not ready again")


def limited(swarm: LabSwarm, text: str) -> Path:
    """The spec, deployed, with limits for the battery of k3, and ``text``."""
    k3 = "k3: {type: khepera3, host: k3-pi"
    limits = f"{k3}, settings: {{battery: {{low: 0.4, empty: 0.2}}}}"
    spec = swarm.variant("batteries", (k3, limits), (CONTROL, CONTROL + text))
    assert swarm.deploy(spec).status == exit_codes.OK
    return spec


def ready(swarm: LabSwarm, spec: Path) -> bool:
    return swarm.swarmctl("ready", spec=spec).status == exit_codes.OK
