"""``swarmctl doctor`` on the hosts of the lab."""

from __future__ import annotations

from swarmctl.cli import exit_codes
from tests.e2e.lab_swarm import LabSwarm


def test_a_sound_host_passes_and_one_that_is_cut_is_found(swarm: LabSwarm) -> None:
    run = swarm.swarmctl("doctor", "k3", "--json")
    assert run.status == exit_codes.OK, run.out + run.err
    host = {one["check"]: one["state"] for one in run.json()["checks"] if one["host"] == "k3-pi"}
    assert host.pop("ping") in ("ok", "skipped")  # without the program
    assert set(host.values()) == {"ok"}
    assert {"address", "port", "login", "root", "disk"} <= set(host)
    swarm.cut("k3-pi")
    try:
        run = swarm.swarmctl("doctor")
        assert run.status == exit_codes.UNHEALTHY
        lines = run.out.splitlines()
        assert "k3-pi" in lines
        assert any(line.startswith("✗ port: k3-pi ") for line in lines)
        assert "- login: needs host key" in lines
    finally:
        swarm.join("k3-pi")
