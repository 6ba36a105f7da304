"""The kinds of faults, in the order in which they are ended: a host that is off is started first."""

from __future__ import annotations

from collections.abc import Sequence

from swarmctl.lab.faults import network_faults, power_faults, robot_faults, system_faults
from swarmctl.lab.faults.fault_kind import FaultKind, RunningLab

KINDS: dict[str, FaultKind] = {
    kind.name: kind
    for kind in (
        power_faults.POWER_OFF,
        power_faults.REBOOT,
        network_faults.LINK_DOWN,
        network_faults.BANDWIDTH,
        network_faults.LOSS,
        network_faults.NO_MULTICAST,
        system_faults.CLOCK,
        system_faults.DISK_FULL,
        system_faults.READ_ONLY,
        robot_faults.UNPLUG,
        robot_faults.STALL,
        robot_faults.KILL,
    )
}


def end_all(lab: RunningLab, hosts: Sequence[str], robots: Sequence[str]) -> None:
    """Ends every fault of hosts and robots; does nothing where there is none. Raises ``LabError``."""
    for end, of_robots in dict.fromkeys((kind.end, kind.of_robots) for kind in KINDS.values()):
        end(lab, robots if of_robots else hosts)
