"""The programs of a host: launch files, parameters, units; scripts for people at a terminal."""

from __future__ import annotations

import shlex
from collections.abc import Iterator

from swarmctl.field_types import Value
from swarmctl.render import shipped_files
from swarmctl.render.bundle import File, Part, Unit
from swarmctl.render.program_needs import installed, secret_words
from swarmctl.render.program_words import TELEOP, container_name, runs_alone, with_values
from swarmctl.render.quoting import render
from swarmctl.render.ros1 import delivered_packages
from swarmctl.render.ros1.program_commands import (
    RUN_NODE,
    command_of,
    environment_of,
    launch_path,
)
from swarmctl.render.ros1.program_files import files_of, loaded_files
from swarmctl.render.ros1.release import FACE, ROS_CLIENT, RUNNING, as_client, ros_client
from swarmctl.render.service_values import home, service_values
from swarmctl.robot_types.ros_launchable import filled
from swarmctl.swarm import names, used_packages
from swarmctl.swarm.program_values import secrets_folder, values_of
from swarmctl.swarm.resolved import Host, Program, Swarm

_HAS_PACKAGES = "bin/has-packages"
_GIVE_SECRETS = "bin/give-secrets"


def files(swarm: Swarm, host: Host) -> Iterator[File]:
    """Yields what the programs of ``host`` need, their units aside."""
    programs = swarm.programs_on(host.name)
    if programs:
        yield ros_client()
    if any(installed(swarm, one) for one in programs if one.declared.optional):
        yield File(_HAS_PACKAGES, shipped_files.text("ros1/has-packages"), 0o755)
    if any(one.declared.use for one in programs):
        yield from shipped_files.folder(TELEOP, FACE)
    if any(one.declared.secrets.names for one in programs):
        yield File(_GIVE_SECRETS, shipped_files.text("os/give-secrets"), 0o755)
    if any(runs_alone(one) for one in programs):
        yield File(RUN_NODE, shipped_files.text("ros1/run-node"), 0o755)
    yield from delivered_packages.files(swarm, host, used_packages.on_host(swarm, host))
    yield from delivered_packages.space_marker(swarm, host)
    for program in programs:
        origin = f"programs.{program.name}"
        if _has_launch_file(program):
            yield File(launch_path(program), _launch(swarm, program), origin=origin)
        yield from files_of(swarm, program)


def terminal_scripts(swarm: Swarm, host: Host) -> Iterator[File]:
    """Yields a script for each program of ``host`` that a person starts at a terminal."""
    for program in swarm.programs_on(host.name):
        if program.is_interactive:
            text = render(
                "interactive.bash",
                home=home(swarm),
                enclave="",
                command=as_client(swarm, command_of(swarm, program)),
            )
            yield File(f"bin/{program.name}", text, 0o755, f"programs.{program.name}")


def units(swarm: Swarm, host: Host) -> Iterator[Part]:
    """Yields a unit for each program of ``host`` that runs without a person at a terminal."""
    for program in swarm.programs_on(host.name):
        if program.runs_by_itself:
            yield _unit(swarm, host, program)


def _launch(swarm: Swarm, program: Program) -> bytes:
    declared = program.declared
    return render(
        "program.launch",
        group=declared.namespace_around(program.namespace),
        node=program.node.rpartition("/")[2],
        package=declared.package,
        executable=declared.executable,
        launch=declared.launch,
        loaded=list(loaded_files(swarm, program)),
        words=shlex.join(with_values(swarm, program, declared.words)),
        arguments=list(_arguments(swarm, program).items()),
        remap=list(declared.remap.items()),
        environment=list(environment_of(swarm, program).items()),
        own=names.unit(swarm.name, program.name) if program.runs_by_itself else "",
        by_hand=[names.unit(swarm.name, program.name)],
    )


def _arguments(swarm: Swarm, program: Program) -> dict[str, Value]:
    """The arguments of a launch file."""
    values = values_of(swarm, program)
    return {name: filled(value, values) for name, value in program.declared.arguments.items()}


def _unit(swarm: Swarm, host: Host, program: Program) -> Part:
    name = names.unit(swarm.name, program.name)
    packages = installed(swarm, program) if program.declared.optional else ()
    container, oneshot = program.declared.container, program.declared.lifecycle == "oneshot"
    text = render(
        "program.service",
        **service_values(swarm, host),
        program=program.name,
        packages=packages,
        command=as_client(swarm, command_of(swarm, program), forever=not oneshot and container is None),
        ends_together=False,
        runtime=names.runtime_folder(swarm.name, program.name),
        memory_mb=program.declared.memory_mb,
        shipped=program.declared.use is not None,
        container=container_name(swarm, program) if container is not None else "",
        engine=container.engine if container is not None else "",
        oneshot=oneshot,
        secrets=secret_words(swarm, host, program),
        secrets_folder=secrets_folder(swarm.name, program.name),
        user=host.user,
    )
    file = File(f"units/{name}", text, origin=f"programs.{program.name}")
    own_packages = used_packages.of_program(swarm, program)
    own = (file.path for file in delivered_packages.files(swarm, host, own_packages))
    needs = [file.path, *RUNNING, ROS_CLIENT, *_reads(swarm, program), *own]
    if packages:
        needs.append(_HAS_PACKAGES)
    secrets = program.declared.secrets.names
    if secrets:
        needs.append(_GIVE_SECRETS)
    return Part(
        (file,), (Unit(name, tuple(needs), program=program.name, packages=packages, secrets=secrets),)
    )


def _reads(swarm: Swarm, program: Program) -> Iterator[str]:
    """The files whose change restarts a program."""
    if _has_launch_file(program):
        yield launch_path(program)
    if runs_alone(program):
        yield RUN_NODE
    if program.declared.use is not None:
        yield from (file.path for file in shipped_files.folder(TELEOP, FACE))
    yield from (file.path for file in files_of(swarm, program))


def _has_launch_file(program: Program) -> bool:
    return program.declared.executable is not None or program.declared.launch is not None
