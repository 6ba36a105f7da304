"""The values of a program's placeholders, such as `{host}`, and the texts that may have them. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from swarmctl.robot_types.ros_launchable import Loc, texts_in
from swarmctl.spec import program_model as declared_program
from swarmctl.swarm import names
from swarmctl.swarm.resolved import Host, Program, Swarm

#: Every placeholder with its meaning.
PLACEHOLDERS: Mapping[str, str] = {
    "swarm": "the swarm's name",
    "program": "the program's name",
    "host": "its host",
    "address": "the address of its host",
    "master_uri": "the URI of its ROS master; not with ROS 2, which has none",
    "namespace": "its ROS namespace, without the leading slash; empty if it has none",
    "robot": "its robot; only of a program with `robot`",
    "files": "the folder of its `files` on the host",
    "secrets": "the folder of its secret files on the host",
}


def available_to(program: declared_program.Program) -> tuple[str, ...]:
    """Returns the placeholders that a program has values for."""
    given = {"robot": program.robot, "files": program.files, "secrets": program.secrets.files}
    return tuple(name for name in PLACEHOLDERS if given.get(name, True))


def values_of(swarm: Swarm, program: Program) -> Mapping[str, str]:
    """Returns the value of each placeholder."""
    host = swarm.hosts[program.host]
    found = {
        "swarm": swarm.name,
        "program": program.name,
        "host": host.name,
        "address": host.ros_address,
        **_master(swarm, host),
        "namespace": program.namespace[1:],
        "files": files_folder(swarm.name, program.name),
        "secrets": secrets_folder(swarm.name, program.name),
    }
    robot = program.declared.robot
    return {**found, "robot": robot} if robot is not None else found


def _master(swarm: Swarm, host: Host) -> Mapping[str, str]:
    island = swarm.island_of(host.name)
    return {"master_uri": swarm.master_uri(island)} if island.has_master else {}


def template_values(swarm: Swarm, program: Program) -> Mapping[str, object]:
    """Returns what a template of the program may use: its placeholders, its node, all hosts and robots."""
    return {
        **values_of(swarm, program),
        "node": program.node,
        "hosts": {host.name: host.ros_address for host in swarm.hosts.values()},
        "robots": list(swarm.robots),
    }


def files_folder(swarm: str, program: str) -> str:
    """Returns the folder of a program's files on its host."""
    return f"/opt/swarm/{swarm}/current/files/{program}"


def texts_of(program: declared_program.Program) -> Iterator[tuple[Loc, str]]:
    """Yields every text that may have placeholders, with its place within the program.

    Parameters of the programs that swarmctl ships are their settings, and have none.
    """
    yield from texts_in(program.environment, "environment")
    if program.use is not None:
        return
    if program.package is not None and (program.launch is None or not program.args):
        own = {name: one for name, one in program.params.items() if name not in program.file_params}
        yield from texts_in(own, "params")
    yield from texts_in(program.command, "command")
    if program.container is not None:
        yield from texts_in(program.container.command, "container", "command")
    yield from texts_in(program.args, "args")


def secrets_folder(swarm: str, program: str) -> str:
    """Returns the folder of a program's secrets on its host: in memory, and gone when the program ends."""
    return f"/run/swarm-secrets/{names.runtime_folder(swarm, program)}"
