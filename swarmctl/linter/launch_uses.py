"""The launch files that a spec starts, of programs and of drivers, each evaluated with its arguments."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from swarmctl.field_types import Parameter
from swarmctl.robot_types.ros_launchable import PlaceholderError, RosLaunchable, filled
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.ros_packages.launch_files import Launched, evaluate
from swarmctl.spec.program_model import Program
from swarmctl.swarm.addresses import ros_address
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.program_values import files_folder, secrets_folder
from swarmctl.swarm.ros_drivers import placeholder_values
from swarmctl.yamltext.source import Loc

_MAX_LAUNCHED = 50_000  # elements of all launch files together


@dataclass(frozen=True)
class LaunchUse:
    """One launch file with who starts it, where, and what it starts.

    ``loc`` is the mapping in the spec that names the file, or in the file of the robot type ``of_type``.
    """

    owner: str  # for messages, such as "program `nav`"
    name: str  # of the program or the robot
    robot: str | None  # whose driver it is, or in whose namespace it runs
    host: str | None
    namespace: str
    started: RosLaunchable
    requires: tuple[str, ...]
    loc: Loc
    launched: Launched
    of_type: str = ""

    @property
    def is_driver(self) -> bool:
        """True for the driver of a robot."""
        return self.loc[:1] != ("programs",)


def launch_uses(index: SwarmIndex) -> tuple[LaunchUse, ...]:
    """Returns the launch files whose packages are found; those beyond a limit of elements are left out."""
    packages, left = index.document.packages.by_name, _MAX_LAUNCHED
    found: list[LaunchUse] = []
    for use, arguments in declared_launches(index) if packages else ():
        package, path = packages.get(use.started.package or ""), f"launch/{use.started.launch}"
        if package is not None and path in package.files and left > 0:
            around = f"/{use.started.namespace_around(use.namespace)}"
            launched = evaluate(package, path, arguments, around, packages, limit=left)
            found.append(replace(use, launched=launched))
            left -= launched.cost + 1
    return tuple(found)


def nodes_of(uses: Iterable[LaunchUse]) -> Mapping[tuple[str, str], frozenset[str]]:
    """The names of the nodes that launch files start for sure, by host and program or robot."""
    return {
        (use.host, use.name): frozenset(
            node.name for node in use.launched.nodes if node.name is not None and node.certain
        )
        for use in uses
        if use.host is not None
    }


def declared_launches(index: SwarmIndex) -> Iterator[tuple[LaunchUse, Mapping[str, str | None]]]:
    """Yields the launch files that the spec names, not read yet, with the arguments that they get."""
    for name, program in index.spec.programs.items():
        if program.launch is not None:
            host = index.program_hosts[name]
            use = LaunchUse(
                f"program `{name}`", name, program.robot, host, index.program_namespaces[name], program,
                program.requires, ("programs", name), Launched(),
            )  # fmt: skip
            yield use, _arguments(program, _values(index, name, program, host))
    for name, driver in index.ros_drivers.items():
        if driver.launch is not None:
            loc, of_type = _place(index, name)
            host, space = index.driving[name], index.namespaces[name]
            use = LaunchUse(
                f"the driver of robot `{name}`", name, name, host, space, driver, driver.requires, loc,
                Launched(), of_type,
            )  # fmt: skip
            known = host if host in index.spec.hosts else None
            address = ros_address(index.spec, known) if known else ""
            values = placeholder_values(name, space, known or "", address, {})
            yield use, _arguments(driver, values)


def _place(index: SwarmIndex, robot: str) -> tuple[Loc, str]:
    """Where the driver of a robot is written: in the robot, in its type, or out of sight in the catalog."""
    given = index.spec.robots[robot]
    if given.driver is not None:
        return ("robots", robot, "driver"), ""
    kind = index.document.own_types.get(given.type)
    if isinstance(kind, RosRobotType):
        return kind.place_of(index.ros_drivers[robot]), given.type
    return ("robots", robot, "type"), ""


def _values(index: SwarmIndex, name: str, program: Program, host: str | None) -> Mapping[str, str]:
    """The values of a program's placeholders but for the URI of its master."""
    values = {
        "swarm": index.spec.name,
        "program": name,
        "namespace": index.program_namespaces[name][1:],
        "files": files_folder(index.spec.name, name),
        "secrets": secrets_folder(index.spec.name, name),
    }
    if host in index.spec.hosts:
        values |= {"host": host, "address": ros_address(index.spec, host)}
    return {**values, "robot": program.robot} if program.robot is not None else values


def _arguments(started: RosLaunchable, values: Mapping[str, str | int]) -> Mapping[str, str | None]:
    """The arguments as roslaunch gets them; None for one with a placeholder whose value is not known here."""
    return {name: _argument(value, values) for name, value in started.arguments.items()}


def _argument(value: Parameter, values: Mapping[str, str | int]) -> str | None:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        try:
            return str(filled(value, values))
        except PlaceholderError:
            return None
    return str(value)
