"""A deployed swarm changes its mode, and nothing of the old one is left."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.e2e.lab_swarm import LabSwarm
from tests.e2e.recovery import LAPTOP, SPECS, STATIC, deployed, obeyed, standing, whole


def processes(swarm: LabSwarm, host: str) -> dict[str, int]:
    """How many masters, drivers and multimasters run on a host, whoever started them."""
    output = swarm.shell(host, "ps -eo args")
    return {
        what: sum(program in line for line in output.splitlines())
        for what, program in {
            "master": "rosmaster --core", "driver": "serial_driver.py",
            "multimaster": "static_multimaster.py",
        }.items()
    }  # fmt: skip


def converted(swarm: LabSwarm, spec: Path, mode: str) -> None:
    """The spec as `mode convert` writes it; of several masters one receives k3's odometry."""
    spec.write_text("".join(one for one in spec.read_text().splitlines(True) if "multimaster" not in one))
    run = swarm.run("mode", "convert", str(spec), "--to", mode, "--write")
    assert run.status == 0, run.err
    receiver = {"standalone": LAPTOP, "combined": "main"}.get(mode)
    spec.write_text(spec.read_text() + (STATIC % receiver if receiver else ""))


@pytest.mark.slow
def test_a_deployed_swarm_changes_its_mode_and_leaves_nothing_behind(isles: LabSwarm) -> None:
    """Leader, standalone, combined, leader: what is to run runs and nothing else, and robots stand still."""
    spec = deployed(isles, "walk", SPECS["leader"])
    whole(isles, spec)
    before = {host: processes(isles, host) for host in isles.hosts}
    for mode, masters in (("standalone", 3), ("combined", 2), ("leader", 1)):
        converted(isles, spec, mode)
        with standing(isles):
            run = isles.deploy(spec)
            assert run.status == 0, run.out + run.err
            whole(isles, spec)
        now = {host: processes(isles, host) for host in isles.hosts}
        assert sum(one["master"] for one in now.values()) == masters
        assert all(one["driver"] == 1 for one in now.values())
        assert isles.plan(spec).status == 0
    assert now == before
    obeyed(isles, LAPTOP)
