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
    run = swarm.run("lab", "scenario", str(swarm.spec), str(file), "--name", swarm.name, "--json")
    assert run.status == 5, run.out + run.err
    shown = run.json()
    assert not shown["as_expected"]
    cable, unit, wrong = shown["faults"]
    assert cable["as_expected"], cable
    assert cable["first"].startswith("device k3: /dev/swarm/k3 does not exist")
    assert unit["as_expected"], unit
    assert (wrong["as_expected"], wrong["detected"]) == (False, None)
    assert wrong["recovered"] is not None
    assert not wrong["first"].startswith("device epuck: ")  # healthy, or what another test has left
