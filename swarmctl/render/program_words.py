"""The words that run programs, as far as they do not depend on ROS. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from swarmctl.robot_types.ros_launchable import filled
from swarmctl.spec.program_model import Container
from swarmctl.swarm import names
from swarmctl.swarm.program_values import files_folder, secrets_folder, values_of
from swarmctl.swarm.resolved import Program, Swarm

TELEOP = "teleop"  # the folder of the shipped programs
FILES_VARIABLE, SECRETS_VARIABLE = "SWARM_FILES", "SWARM_SECRETS"


def with_environment(environment: Mapping[str, str], words: Iterable[str]) -> tuple[str, ...]:
    """Returns ``words``, run with the variables of ``environment``."""
    set_ones = [f"{key}={value}" for key, value in environment.items()]
    return (*(["/usr/bin/env", *set_ones] if set_ones else []), *words)


def environment_of(swarm: Swarm, program: Program) -> Mapping[str, str]:
    """Returns the variables of a program: its own, and the folders of its files and secrets."""
    declared = program.declared
    values = values_of(swarm, program)
    found = {key: str(filled(text, values)) for key, text in declared.environment.items()}
    if declared.files:
        found.setdefault(FILES_VARIABLE, files_folder(swarm.name, program.name))
    if declared.secrets.files:
        found.setdefault(SECRETS_VARIABLE, secrets_folder(swarm.name, program.name))
    return found


def with_values(swarm: Swarm, program: Program, words: Iterable[str]) -> tuple[str, ...]:
    """Returns words with their placeholders filled in. Raises PlaceholderError."""
    values = values_of(swarm, program)
    return tuple(str(filled(word, values)) for word in words)


def container_name(swarm: Swarm, program: Program) -> str:
    """Returns the name of a program's container, by which its engine stops it."""
    return names.runtime_folder(swarm.name, program.name)


def runs_alone(program: Program) -> bool:
    """True of a node that takes the place of roslaunch: one at a terminal, or whose exit code counts."""
    return program.declared.executable is not None and program.declared.lifecycle != "service"


def container_words(
    swarm: Swarm,
    program: Program,
    container: Container,
    variables: Iterable[str],
    options: Iterable[str] = (),
) -> Iterator[str]:
    """Yields the words of `podman run` and `docker run`, which are alike; docker's daemon runs containers.

    ``variables``: those of its unit's environment that the program gets; ``options``: further ones.
    """
    declared = program.declared
    yield from (container.engine, "run", "--rm", "--name", container_name(swarm, program))
    yield from ("--network", "host", "--log-driver", "none", "--stop-signal", "SIGINT")
    yield from options
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
    for name in variables:
        yield from ("--env", name)
    yield container.image
    yield from with_values(swarm, program, (*container.command, *declared.words))
