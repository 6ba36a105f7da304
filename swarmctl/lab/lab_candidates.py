"""What selections can name in a lab without its spec: the hosts and the robots of its plan."""

from __future__ import annotations

from collections.abc import Iterable

from swarmctl.lab.lab_plan import LabPlan
from swarmctl.spec.selection_candidates import Candidates, RobotFacts
from swarmctl.yamltext import hostlist


def candidates_of(plan: LabPlan) -> Candidates:
    """Returns the hosts, the emulated robots and those with stand-ins.

    Groups, labels and the types of stand-ins' robots are in the spec only.
    """
    stand_ins = {one.robot: RobotFacts("", one.host) for one in plan.stand_ins}
    return Candidates(
        hosts={host.name: () for host in plan.hosts},
        robots=stand_ins | {robot.name: RobotFacts(robot.type, robot.host) for robot in plan.robots},
    )


def names_all(known: Candidates, selections: Iterable[str]) -> bool:
    """Returns True if each selection is a name or a range of names of ``known``: it means the same there."""
    ranges = ((one, hostlist.read(one)) for one in selections)
    names = [found.names if isinstance(found, hostlist.Range) else (one,) for one, found in ranges]
    return all(name in known.hosts_and_robots for some in names for name in some)
