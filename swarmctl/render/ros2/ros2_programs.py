"""The programs of a host: parameters, launch files, units; scripts for people at a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from swarm_onboard.agent.paths import trial_file

from swarmctl.render import shipped_files
from swarmctl.render.bundle import File, Part, Unit
from swarmctl.render.program_parts import (
    TELEOP,
    container_name,
    container_words,
    environment_of,
    installed,
    own_files,
    params_path,
    secret_words,
    with_environment,
    with_values,
)
from swarmctl.render.quoting import render
from swarmctl.render.ros2 import enclaves, graph_environment
from swarmctl.render.ros2.node_words import node_params, remapping, ros_args
from swarmctl.render.ros2.ros2_release import FACE, RUN_NODE, run_node, running, unit_values
from swarmctl.render.service_values import home
from swarmctl.robot_types.ros_launchable import filled
from swarmctl.ros_packages.parameters import read_file
from swarmctl.spec.program_model import Container
from swarmctl.swarm import names
from swarmctl.swarm.program_values import secrets_folder, values_of
from swarmctl.swarm.resolved import Host, Island, Program, Swarm
from swarmctl.swarm.shipped_programs import SCRIPTS

_HAS_PACKAGES, _GIVE_SECRETS = "bin/has-packages", "bin/give-secrets"


def files(swarm: Swarm, host: Host) -> Iterator[File]:
    """Yields what the programs of ``host`` need, their units aside."""
    programs = swarm.programs_on(host.name)
    if any(installed(swarm, one) for one in programs if one.declared.optional):
        yield File(_HAS_PACKAGES, shipped_files.text("ros2/has-packages"), 0o755)
    if any(one.declared.use for one in programs):
        yield from shipped_files.folder(TELEOP, FACE)
    if any(one.declared.secrets.names for one in programs):
        yield File(_GIVE_SECRETS, shipped_files.text("os/give-secrets"), 0o755)
    for program in programs:
        yield from _files_of(swarm, program)


def terminal_scripts(swarm: Swarm, host: Host, island: Island) -> Iterator[File]:
    """Yields a script for each program of ``host`` that a person starts at a terminal."""
    for program in swarm.programs_on(host.name):
        if program.is_interactive:
            command = _command_of(swarm, host, island, program)
            enclave = enclaves.of_program(swarm, program).name if swarm.sros2 else ""
            text = render("interactive.bash", home=home(swarm), command=command, enclave=enclave)
            yield File(f"bin/{program.name}", text, 0o755, f"programs.{program.name}")


def units(swarm: Swarm, host: Host, island: Island) -> Iterator[Part]:
    """Yields a unit for each program of ``host`` that runs without a person at a terminal."""
    for program in swarm.programs_on(host.name):
        if program.runs_by_itself:
            yield _unit(swarm, host, island, program)


def _unit(swarm: Swarm, host: Host, island: Island, program: Program) -> Part:
    name, declared = names.unit(swarm.name, program.name), program.declared
    packages = installed(swarm, program) if declared.optional else ()
    container, enclave = declared.container, enclaves.of_program(swarm, program)
    text = render(
        "program.service",
        **{**unit_values(swarm, host, island), **enclaves.unit_values(swarm, enclave)},
        program=program.name,
        packages=packages,
        command=_command_of(swarm, host, island, program),
        ends_together=declared.command is not None,
        runtime=names.runtime_folder(swarm.name, program.name),
        memory_mb=declared.memory_mb,
        shipped=declared.use is not None,
        container=container_name(swarm, program) if container is not None else "",
        engine=container.engine if container is not None else "",
        lifecycle=declared.lifecycle,
        trial_file=trial_file(name),
        secrets=secret_words(swarm, host, program),
        secrets_folder=secrets_folder(swarm.name, program.name),
        user=host.user,
    )
    file = File(f"units/{name}", text, origin=f"programs.{program.name}")
    shipped = (one.path for one in shipped_files.folder(TELEOP, FACE)) if declared.use is not None else ()
    secrets = declared.secrets.names
    needs = (
        file.path,
        *running(swarm, host, island),
        *([RUN_NODE] if declared.executable is not None else []),
        *(one.path for one in _files_of(swarm, program)),
        *shipped,
        *([_HAS_PACKAGES] if packages else []),
        *([_GIVE_SECRETS] if secrets else []),
        *enclaves.enclave_needs(swarm, enclave),
    )
    secrets = (*secrets, *enclaves.secrets_of(swarm, enclave))
    unit = Unit(
        name, needs, program=program.name, packages=packages, secrets=secrets,
        in_trials=declared.lifecycle == "trial",
    )  # fmt: skip
    return Part((file,), (unit,))


def _command_of(swarm: Swarm, host: Host, island: Island, program: Program) -> tuple[str, ...]:
    declared, environment = program.declared, environment_of(swarm, program)
    if declared.use is not None:
        words = _shipped(swarm, program)
    elif declared.container is not None:
        words = tuple(_container(swarm, host, island, program, declared.container))
    elif declared.command is not None:
        words = with_values(swarm, program, declared.command)
    elif declared.package is not None and declared.executable is not None:
        params = [f"{home(swarm)}/current/{one.path}" for one in _parameter_files(swarm, program)]
        words = (
            *run_node(swarm, declared.package, declared.executable),
            *with_values(swarm, program, declared.words),
            *ros_args(program.node, declared.remap, params),
        )
    else:
        words = ("ros2", "launch", f"{home(swarm)}/current/{_launch_path(program)}")
    return with_environment(environment, words)


def _shipped(swarm: Swarm, program: Program) -> tuple[str, ...]:
    current, declared = f"{home(swarm)}/current", program.declared
    return (
        "/usr/bin/python3", f"{current}/{TELEOP}/{SCRIPTS[declared.use or '']}",
        "--config", f"{current}/{params_path(program)}",
        *ros_args(remap=declared.remap),
    )  # fmt: skip


def _container(
    swarm: Swarm, host: Host, island: Island, program: Program, container: Container
) -> Iterator[str]:
    """As a host's own program: it reads the same files."""
    own = (*environment_of(swarm, program), *program.declared.secrets.env)
    variables = ("SWARM", *graph_environment.of_nodes(swarm, host, island), *own)
    folders = [f"{home(swarm)}/current/env"]
    if swarm.sros2:
        folders.append(f"/run/{names.runtime_folder(swarm.name, program.name)}")
    options = (word for one in folders for word in ("--volume", f"{one}:{one}:ro"))
    return container_words(swarm, program, container, variables, tuple(options))


def _files_of(swarm: Swarm, program: Program) -> Iterator[File]:
    """The files that a program reads: its parameters or launch file, and its own ones."""
    origin, declared = f"programs.{program.name}", program.declared
    yield from own_files(swarm, program)
    yield from _parameter_files(swarm, program)
    if declared.launch is not None:
        values = values_of(swarm, program)
        text = render(
            "ros2/program.launch.xml",
            group=declared.namespace_around(program.namespace),
            package=declared.package,
            launch=declared.launch,
            arguments=[(name, filled(value, values)) for name, value in declared.arguments.items()],
            remap=list(remapping(declared.remap).items()),
            environment=list(environment_of(swarm, program).items()),
        )
        yield File(_launch_path(program), text, origin=origin)


def _parameter_files(swarm: Swarm, program: Program) -> Iterator[File]:
    """The files of ROS 2 beside the spec as they are, then the other parameters: the last ones count."""
    origin, declared = f"programs.{program.name}", program.declared
    if declared.executable is None:
        return
    values, params, node = values_of(swarm, program), dict[str, Any](), "/**"
    for name, value in declared.params.items():
        path = declared.file_params.get(name)
        read = read_file(program.beside[path], "rcl") if path is not None else None
        if read is None:
            params[name] = filled(value, values)
        elif path is not None and read.nodes:
            node = program.node
            yield File(f"params/{program.name}/{name}.yaml", program.beside[path], origin=origin)
        else:
            params[name] = read.values
    if params:
        yield File(params_path(program), node_params(params, node), origin=origin)


def _launch_path(program: Program) -> str:
    return f"launch/{program.name}.launch.xml"
