"""What a program on a host consists of, whatever its ROS: its words, its files, what it needs. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from typing import Any

from swarmctl.render.bundle import File, SecretForm, package
from swarmctl.render.yaml_params import params_file
from swarmctl.robot_types.ros_launchable import filled
from swarmctl.spec.program_model import Container, Template
from swarmctl.swarm import names
from swarmctl.swarm.command_topics import STAMPED_TYPE, CommandTopic
from swarmctl.swarm.program_values import files_folder, rendered, secrets_folder, template_values, values_of
from swarmctl.swarm.resolved import ForeignDriver, Host, Program, Swarm


def params_path(program: Program) -> str:
    """Returns where the parameters of a program are in a release."""
    return f"params/{program.name}.yaml"


def own_files(swarm: Swarm, program: Program) -> Iterator[File]:
    """Yields the parameters of a program that swarmctl ships, and the `files` of any program."""
    origin, declared = f"programs.{program.name}", program.declared
    if declared.use is not None:
        yield File(params_path(program), _shipped_parameters(swarm, program), origin=origin)
    for name, source in declared.files.items():
        if isinstance(source, Template):
            content = rendered(program.beside[source.template], template_values(swarm, program))
        else:
            content = program.beside[source]
        yield File(f"files/{program.name}/{name}", content, origin=origin)


def _shipped_parameters(swarm: Swarm, program: Program) -> bytes:
    """The parameters of a shipped program, with its node and robots."""
    commands = swarm.command_topics
    data = {
        "node": program.node,
        "targets": [_target(one, commands[one]) for one in program.commands if one in commands],
        "params": dict(program.declared.params),
    }
    return params_file(data)


def _target(robot: str, command: CommandTopic) -> Mapping[str, Any]:
    """A robot to command; its messages are of type Twist unless they are stamped."""
    stamped = {"stamped": True} if command.type == STAMPED_TYPE else {}
    return {"robot": robot, "topic": command.topic, **stamped}


def needs_of_drivers(swarm: Swarm, host: Host) -> dict[str, tuple[str, ...]]:
    """Returns the packages that the drivers of ``host`` need, each with the entries of its robots."""
    found: dict[str, tuple[str, ...]] = {}
    for robot in swarm.robots_on(host.name):
        packages = robot.driver.ros.packages if isinstance(robot.driver, ForeignDriver) else ()
        for one in (name for name in packages if name not in swarm.packages):
            found[package(one)] = (*found.get(package(one), ()), f"robots.{robot.name}")
    return found


def requires(swarm: Swarm, host: Host, client: str) -> dict[str, tuple[str, ...]]:
    """Returns what must be installed for programs without which the swarm is not complete, and for which.

    ``client``: the library of ROS that shipped programs need.
    """
    found: dict[str, tuple[str, ...]] = {}
    for program in swarm.programs_on(host.name):
        for name in _required(swarm, program, client):
            found[name] = (*found.get(name, ()), f"programs.{program.name}")
    return found


def secret_forms(swarm: Swarm, host: Host) -> dict[str, SecretForm]:
    """Returns the secrets of the programs of ``host``, with what they may hold."""
    declared = [one.declared.secrets for one in swarm.programs_on(host.name)]
    files: dict[str, SecretForm] = {one.secret: "text" for each in declared for one in each.files.values()}
    return {**files, **{one.secret: "line" for each in declared for one in each.env.values()}}


def _required(swarm: Swarm, program: Program, client: str) -> tuple[str, ...]:
    """What must be installed for a program; an optional one is skipped without its packages."""
    ours = (client,) if program.declared.use else ()
    if program.declared.optional:
        return ours
    container = program.declared.container
    engine = (container.engine,) if container is not None else ()
    return (*ours, *engine, *map(package, installed(swarm, program)))


def secret_words(swarm: Swarm, host: Host, program: Program) -> tuple[str, ...]:
    """Returns the arguments of `give-secrets`; none for a program without secrets."""
    secrets = program.declared.secrets
    if not secrets.names:
        return ()
    variables = (("--variable", f"{key}={one.secret}") for key, one in secrets.env.items())
    files = (("--file", f"{name}={one.secret}") for name, one in secrets.files.items())
    owner = "root" if program.declared.container is not None else host.user
    return (
        "--owner", owner, "--source", f"/etc/swarm/{swarm.name}/secrets",
        "--to", secrets_folder(swarm.name, program.name), *chain(*variables, *files),
    )  # fmt: skip


def installed(swarm: Swarm, program: Program) -> tuple[str, ...]:
    """Returns the packages that must lie on the host already."""
    declared = program.declared
    named = dict.fromkeys([*([declared.package] if declared.package else []), *declared.requires])
    return tuple(name for name in named if name not in swarm.packages)


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
