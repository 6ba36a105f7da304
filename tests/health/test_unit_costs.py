"""What units cost between two reports of their host."""

from __future__ import annotations

from swarm_onboard.agent.verbs.costs import Answer, UnitCosts

from swarmctl.health.host_costs import UnitCost, between, chosen
from swarmctl.remote.transport import HostError, Kind


def report(clock: float, **cpu: float) -> Answer:
    units = {f"swarm-lab.{name.replace('_', '.')}.service": seconds for name, seconds in cpu.items()}
    return Answer(clock, {unit: UnitCosts(seconds, 5, 1) for unit, seconds in units.items()})


def test_the_busiest_comes_first_and_ended_units_are_left_out() -> None:
    found = between("pi", "lab", report(10.0, k3=1.0, gone=5.0), report(12.0, k3=1.5, k3_gate=3.0))
    assert found == [UnitCost("pi", "k3/gate", 1.5, 5, 1), UnitCost("pi", "k3", 0.25, 5, 1)]


def test_a_restart_is_no_negative_cost() -> None:
    [found] = between("pi", "lab", report(10.0, k3=9.0), report(12.0, k3=0.5))
    assert found.cpu == 0.0


def test_a_selected_robot_has_all_its_units() -> None:
    units = between("pi", "lab", report(0.0), report(1.0, k3=0.1, k3_gate=0.2, koala=0.3))
    away = HostError(Kind.UNREACHABLE, "no route to host")
    found, errors = chosen({"pi": units, "desk": away}, {"pi": ["k3"], "desk": []})
    assert [one.name for one in found] == ["k3/gate", "k3"]
    assert errors == {"desk": away}
    assert len(chosen({"pi": units}, {"pi": []})[0]) == 3
