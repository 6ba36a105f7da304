"""The words that run each kind of program, behind `ros-client`. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from swarmctl.render.ros1.program_files import params_path
from swarmctl.render.ros1.release import home
from swarmctl.robot_types.placeholders import filled
from swarmctl.robot_types.ros_launchable import RosLaunchable
from swarmctl.spec.program_model import Container
from swarmctl.swarm import names
from swarmctl.swarm.program_values import files_folder, secrets_folder, values_of
from swarmctl.swarm.resolved import Program, Swarm
from swarmctl.swarm.shipped_programs import SCRIPTS

TELEOP = "teleop"
RUN_NODE = "bin/run-node"
FILES_VARIABLE, SECRETS_VARIABLE = "SWARM_FILES", "SWARM_SECRETS"
# What a program in a container needs to know of its ROS; the values are those of the unit's environment.
_PASSED = ("ROS_MASTER_URI", "ROS_IP", "ROS_HOSTNAME")
_IPV6 = ("ROS_IPV6",)


def command_of(swarm: Swarm, program: Program) -> tuple[str, ...]:
    """Returns what `ros-client` runs."""
    declared = program.declared
    if declared.use is not None:
        words = _shipped(swarm, program)
    elif declared.container is not None:
        words = tuple(_container(swarm, program, declared.container))
    elif declared.command is not None:
        words = with_values(swarm, program, declared.command)
    else:
        return _launched(swarm, program)
    return with_environment(environment_of(swarm, program), words)


def with_environment(environment: Mapping[str, str], words: Iterable[str]) -> tuple[str, ...]:
    """Returns ``words``, run with the variables of ``environment``."""
    set_ones = [f"{key}={value}" for key, value in environment.items()]
    return (*(["/usr/bin/env", *set_ones] if set_ones else []), *words)


def roslaunched(path: str, declared: RosLaunchable, environment: Mapping[str, str]) -> tuple[str, ...]:
    """Returns the words that launch the file at ``path``, made of what is ``declared``.

    A launch file of a package may read variables by `$(env NAME)`. roslaunch takes these from its own
    environment, not from the tags `<env>`, which are for nodes.
    """
    words = ("roslaunch", "--wait", "--screen", "--disable-title", path)
    return with_environment(environment, words) if declared.launch is not None else words


def environment_of(swarm: Swarm, program: Program) -> Mapping[str, str]:
    """Returns the variables of a program: its own, the folder of its files, and its namespace."""
    declared = program.declared
    values = values_of(swarm, program)
    found = {key: str(filled(text, values)) for key, text in declared.environment.items()}
    if declared.files:
        found.setdefault(FILES_VARIABLE, files_folder(swarm.name, program.name))
    if declared.secrets.files:
        found.setdefault(SECRETS_VARIABLE, secrets_folder(swarm.name, program.name))
    names_itself = declared.command is not None or declared.container is not None
    if names_itself and program.namespace:
        found["ROS_NAMESPACE"] = program.namespace
    return found


def with_values(swarm: Swarm, program: Program, words: Iterable[str]) -> tuple[str, ...]:
    """Returns words with their placeholders filled in. Raises PlaceholderError."""
    values = values_of(swarm, program)
    return tuple(str(filled(word, values)) for word in words)


def container_name(swarm: Swarm, program: Program) -> str:
    """Returns the name of a program's container, by which its engine stops it."""
    return names.runtime_folder(swarm.name, program.name)


def launch_path(program: Program) -> str:
    """Returns where the launch file of a program is in a release."""
    return f"launch/{program.name}.launch"


def runs_alone(program: Program) -> bool:
    """True of a node that takes the place of roslaunch: one at a terminal, or whose exit code counts."""
    return program.declared.executable is not None and program.declared.lifecycle != "service"


def _launched(swarm: Swarm, program: Program) -> tuple[str, ...]:
    current, declared = f"{home(swarm)}/current", program.declared
    launch_file = f"{current}/{launch_path(program)}"
    if runs_alone(program):
        return "/usr/bin/python3", f"{current}/{RUN_NODE}", launch_file
    return roslaunched(launch_file, declared, environment_of(swarm, program))


def _shipped(swarm: Swarm, program: Program) -> tuple[str, ...]:
    current, declared = f"{home(swarm)}/current", program.declared
    namespace, _, node = program.node.rpartition("/")
    return (
        "/usr/bin/python3", f"{current}/{TELEOP}/{SCRIPTS[declared.use or '']}",
        "--config", f"{current}/{params_path(program)}",
        f"__ns:={namespace or '/'}", f"__name:={node}",
        *(f"{old}:={new}" for old, new in declared.remap.items()),
    )  # fmt: skip


def _container(swarm: Swarm, program: Program, container: Container) -> Iterator[str]:
    """The words of `podman run` and `docker run`, which are alike; docker's daemon runs its containers."""
    declared = program.declared
    yield from (container.engine, "run", "--rm", "--name", container_name(swarm, program))
    yield from ("--network", "host", "--log-driver", "none", "--stop-signal", "SIGINT")
    if container.engine == "podman":
        yield from ("--cgroups", "split")
    elif declared.memory_mb is not None:
        yield from ("--memory", f"{2 * declared.memory_mb}m")
    if declared.lifecycle == "interactive":
        yield from ("--interactive", "--tty")
    if container.privileged:
        yield "--privileged"
    for device in container.devices:
        yield from ("--device", device)
    folders = [files_folder(swarm.name, program.name)] if declared.files else []
    folders += [secrets_folder(swarm.name, program.name)] if declared.secrets.files else []
    for volume in (*(f"{folder}:{folder}:ro" for folder in folders), *container.volumes):
        yield from ("--volume", volume)
    passed = (*_PASSED, *_IPV6) if swarm.ipv6 else _PASSED
    for name in (*passed, *environment_of(swarm, program), *declared.secrets.env):
        yield from ("--env", name)
    yield container.image
    yield from with_values(swarm, program, (*container.command, *declared.words))
