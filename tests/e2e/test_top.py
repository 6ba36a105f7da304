"""``swarmctl top`` on the hosts of the lab."""

from __future__ import annotations

from swarmctl.cli import exit_codes
from tests.e2e.lab_swarm import LEADER, LabSwarm


def test_it_shows_what_runs_and_a_host_that_is_cut_costs_itself(swarm: LabSwarm) -> None:
    run = swarm.swarmctl("top", "--json")
    assert run.status == exit_codes.OK, run.err
    found = {(one["host"], one["name"]): one for one in run.json()["units"]}
    assert {("k3-pi", "k3"), (LEADER, "master"), (LEADER, "koala")} <= set(found)
    assert all(one["memory"] > 0 and one["processes"] > 0 for one in found.values())
    assert found["k3-pi", "k3"]["cpu"] > 0
    swarm.cut("k3-pi")
    try:
        run = swarm.swarmctl("top")
        assert run.status == exit_codes.HOSTS_UNREACHABLE
        assert "koala" in run.out
        assert "k3-pi  unreachable: " in run.out
    finally:
        swarm.join("k3-pi")
