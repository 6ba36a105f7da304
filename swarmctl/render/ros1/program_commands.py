"""The words that run each kind of program, behind `ros-client`. Pure."""

from __future__ import annotations

from collections.abc import Mapping

from swarmctl.render import program_words
from swarmctl.render.own_program_files import params_path
from swarmctl.render.program_words import TELEOP, container_words, runs_alone, with_environment, with_values
from swarmctl.render.ros1.release import arguments
from swarmctl.render.service_values import home
from swarmctl.robot_types.ros_launchable import RosLaunchable
from swarmctl.swarm.resolved import Program, Swarm
from swarmctl.swarm.shipped_programs import SCRIPTS

RUN_NODE = "bin/run-node"
# What a program in a container needs to know of its ROS; the values are those of the unit's environment.
_PASSED = ("ROS_MASTER_URI", "ROS_IP", "ROS_HOSTNAME")
_IPV6 = ("ROS_IPV6",)


def command_of(swarm: Swarm, program: Program) -> tuple[str, ...]:
    """Returns what `ros-client` runs."""
    declared = program.declared
    if declared.use is not None:
        words = _shipped(swarm, program)
    elif declared.container is not None:
        passed = (*_PASSED, *_IPV6) if swarm.ipv6 else _PASSED
        variables = (*passed, *environment_of(swarm, program), *declared.secrets.env)
        words = tuple(container_words(swarm, program, declared.container, variables))
    elif declared.command is not None:
        words = with_values(swarm, program, declared.command)
    else:
        return _launched(swarm, program)
    return with_environment(environment_of(swarm, program), words)


def roslaunched(path: str, declared: RosLaunchable, environment: Mapping[str, str]) -> tuple[str, ...]:
    """Returns the words that launch the file at ``path``, made of what is ``declared``.

    A launch file of a package may read variables by `$(env NAME)`. roslaunch takes these from its own
    environment, not from the tags `<env>`, which are for nodes.
    """
    words = ("roslaunch", "--wait", "--screen", "--disable-title", path)
    return with_environment(environment, words) if declared.launch is not None else words


def launch_path(program: Program) -> str:
    """Returns where the launch file of a program is in a release."""
    return f"launch/{program.name}.launch"


def environment_of(swarm: Swarm, program: Program) -> Mapping[str, str]:
    """Returns the variables of a program: its own, the folder of its files, and its namespace."""
    found, declared = dict(program_words.environment_of(swarm, program)), program.declared
    if (declared.command is not None or declared.container is not None) and program.namespace:
        found["ROS_NAMESPACE"] = program.namespace
    return found


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
        *arguments(namespace, node),
        *(f"{old}:={new}" for old, new in declared.remap.items()),
    )  # fmt: skip
