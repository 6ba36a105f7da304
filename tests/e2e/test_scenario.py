"""A scenario file in the lab: what it says of faults that status names, and of one that it does not."""

from __future__ import annotations

from tests.e2e.lab_swarm import LabSwarm

SCENARIO = """\
faults:
- name: a cable is unplugged
  fault: unplug k3
  first: "device k3: /dev/swarm/k3 does not exist"
  within: 60
- name: a unit was stopped
  host: k3-pi
  run: systemctl stop swarm-newswarm.k3.service
  undo: systemctl start swarm-newswarm.k3.service
  first: "unit swarm-newswarm.k3.service on k3-pi: does not run"
  within: 60
- name: a wrong expectation
  host: operator
  run: "true"
  swarmctl: plan
  first: "device epuck: "
  within: 0.1
"""


def test_a_scenario_shows_the_first_line_of_status_instead(swarm: LabSwarm) -> None:
    file = swarm.folder / "faults.yaml"
    file.write_text(SCENARIO)
    run = swarm.run("lab", "scenario", str(swarm.spec), str(file), "--name", swarm.name)
    assert run.status == 5, run.out + run.err
    cable, unit, wrong, expected = run.out.splitlines()[1:]
    assert cable.startswith("✓ a cable is unplugged  "), run.out
    assert unit.startswith("✓ a unit was stopped  "), run.out
    assert wrong.startswith("✗ a wrong expectation  "), run.out
    assert wrong.split("  ")[-1].strip(), run.out  # it recovered, in so many seconds
    assert "  healthy  " in wrong
    assert "expected within 0.1 s: device epuck: " in expected
