"""Programs that do not keep running: their host goes back by itself, and the report has their last words."""

from __future__ import annotations

import pytest

from swarmctl.cli import exit_codes
from tests.e2e.lab_swarm import LabSwarm

HOST = "k3-pi"
UNIT = "swarm-newswarm.brief.service"
PROGRAM = """
programs:
  brief: {host: k3-pi, command: [sh, -c, "%s"]}
"""

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("life", ["", "sleep 5; "], ids=["at once", "after 5 s"])
def test_a_program_that_ends_takes_its_host_back(swarm: LabSwarm, life: str) -> None:
    before = swarm.release(HOST)
    spec = swarm.folder / "brief.yaml"
    spec.write_text(swarm.spec.read_text() + PROGRAM % f"{life}echo no camera >&2; exit 1")

    swarm.deployed = None  # hosts without the program may have their new release
    run = swarm.swarmctl("deploy", "--yes", spec=spec)

    assert run.status == exit_codes.HOSTS_FAILED, run.out + run.err
    text = " ".join((run.out + run.err).split())
    assert f"{HOST} failed: {UNIT} does not keep running within 30 s: no camera" in text, text
    assert f"undone, release {before} runs again" in text, text
    assert swarm.release(HOST) == before
    assert swarm.shell(HOST, f"systemctl is-active {UNIT} || true").strip() != "active"
    assert swarm.swarmctl("status").status == exit_codes.OK
