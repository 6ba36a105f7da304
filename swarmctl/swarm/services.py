"""Which services and actions programs and drivers provide, and which ones programs call, as declared."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from swarmctl.swarm import names
from swarmctl.swarm.index import SwarmIndex
from swarmctl.yamltext.source import Loc


@dataclass(frozen=True)
class ServiceEnd:
    """A service or an action that one side declares. ``owner``: in words; ``loc``: where the spec has it.

    ``island``: where it runs; empty if that is not known.
    """

    name: str
    type: str
    provides: bool
    owner: str
    island: str
    optional: bool
    loc: Loc


def service_ends(index: SwarmIndex) -> Iterator[ServiceEnd]:
    """Yields those of drivers, then those of programs, under their full names."""
    for robot, driver in index.ros_drivers.items():
        home, node = index.island_of_robot(robot), names.driver_node(index.namespaces[robot])
        own = driver is index.spec.robots[robot].driver
        for number, one in enumerate(driver.provides):
            yield ServiceEnd(
                names.resolved(one.name, node, driver.remap),
                one.type,
                True,
                f"the driver of `{robot}`",
                home.name if home else "",
                index.spec.robots[robot].optional,
                ("robots", robot, "driver", "provides", number) if own else ("robots", robot),
            )
    for program, declared in index.spec.programs.items():
        home = index.home.get(index.program_hosts[program] or "")
        for key in ("provides", "calls"):
            for number, one in enumerate(getattr(declared, key)):
                yield ServiceEnd(
                    names.resolved(one.name, index.program_nodes[program], declared.remap),
                    one.type,
                    key == "provides",
                    f"program `{program}`",
                    home.name if home else "",
                    declared.optional,
                    ("programs", program, key, number),
                )
