"""Which delivered packages programs, drivers and hosts use."""

from __future__ import annotations

from swarmctl.ros_packages.builds import with_dependencies
from swarmctl.ros_packages.package import DeliveredPackage
from swarmctl.swarm.resolved import ForeignDriver, Host, Program, Swarm


def of_program(swarm: Swarm, program: Program) -> tuple[DeliveredPackage, ...]:
    """Returns the delivered packages that a program uses, with those that they depend on."""
    declared = program.declared
    named = [*([declared.package] if declared.package else []), *declared.requires]
    return with_dependencies(named, swarm.packages)


def of_driver(swarm: Swarm, driver: ForeignDriver) -> tuple[DeliveredPackage, ...]:
    """Returns the delivered packages that a robot's driver uses, with those that they depend on."""
    return with_dependencies(driver.ros.packages, swarm.packages)


def on_host(swarm: Swarm, host: Host) -> tuple[DeliveredPackage, ...]:
    """Returns the delivered packages that the programs and drivers of ``host`` use.

    On the host of a master these are also the packages with the meshes of its robots: RViz is opened there.
    """
    if not swarm.packages:
        return ()
    shown = {name for island in swarm.islands if island.hub == host.name for name in island.hosts}
    urdfs = [robot.urdf for robot in swarm.robots.values() if robot.host in shown and robot.urdf is not None]
    drivers = [robot.driver for robot in swarm.robots_on(host.name)]
    used = [
        *(of_program(swarm, program) for program in swarm.programs_on(host.name)),
        *(of_driver(swarm, driver) for driver in drivers if isinstance(driver, ForeignDriver)),
        *(with_dependencies(urdf.packages, swarm.packages) for urdf in urdfs),
    ]
    return tuple({one.name: one for packages in used for one in packages}.values())


def in_swarm(swarm: Swarm) -> tuple[DeliveredPackage, ...]:
    """Returns the delivered packages that any host uses."""
    used = (one for host in swarm.hosts.values() for one in on_host(swarm, host))
    return tuple({one.name: one for one in used}.values())
