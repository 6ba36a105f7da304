"""The programs of a host: launch files, parameters, units; scripts for people at a terminal."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from typing import Any

from swarm_onboard.agent.paths import trial_file

from swarmctl.field_types import Parameter, Value
from swarmctl.render import program_parts, shipped_files
from swarmctl.render.bundle import File, Part, Unit
from swarmctl.render.program_parts import (
    TELEOP,
    container_name,
    container_words,
    installed,
    own_files,
    params_path,
    runs_alone,
    secret_words,
    with_environment,
    with_values,
)
from swarmctl.render.quoting import render
from swarmctl.render.ros1 import delivered_packages
from swarmctl.render.ros1.release import FACE, ROS_CLIENT, RUNNING, arguments, as_client, ros_client
from swarmctl.render.service_values import home, service_values
from swarmctl.render.yaml_params import params_file
from swarmctl.robot_types.ros_launchable import RosLaunchable, filled
from swarmctl.ros_packages.launch_files import FIND
from swarmctl.swarm import names, used_packages
from swarmctl.swarm.program_values import secrets_folder, values_of
from swarmctl.swarm.resolved import Host, Program, Swarm
from swarmctl.swarm.shipped_programs import SCRIPTS


def files_of(swarm: Swarm, program: Program) -> Iterator[File]:
    """Yields the parameter files of a program, and its own files."""
    origin, declared = f"programs.{program.name}", program.declared
    yield from own_files(swarm, program)
    for path, params, _ in _parameter_files(swarm, program):
        yield File(path, params_file(params), origin=origin)
    for name, path in declared.file_params.items():
        yield File(_path_of(program, name), program.beside[path], origin=origin)


def loaded_files(swarm: Swarm, program: Program) -> Iterator[Mapping[str, Any]]:
    """Yields what a launch file loads for a node: a path, its namespace, and whether to substitute."""
    current = f"{home(swarm)}/current"
    for path, _, substitutes in _parameter_files(swarm, program):
        yield {"file": f"{current}/{path}", "ns": "", "substitutes": substitutes}
    for name in program.declared.file_params:
        yield {"file": f"{current}/{_path_of(program, name)}", "ns": name, "substitutes": False}


def _parameter_files(swarm: Swarm, program: Program) -> Iterator[tuple[str, Mapping[str, Parameter], bool]]:
    """The parameters of a node in files, whose text roslaunch leaves alone, and those with `$(find)`."""
    declared = program.declared
    if declared.executable is None:
        return
    values = values_of(swarm, program)
    plain = {
        name: filled(one, values) for name, one in declared.params.items() if name not in declared.file_params
    }
    found = {name: one for name, one in plain.items() if _has_find(one)}
    rest = {name: one for name, one in plain.items() if name not in found}
    if rest:
        yield params_path(program), rest, False
    if found:
        yield f"params/{program.name}.find.yaml", found, True


def _path_of(program: Program, name: str) -> str:
    return f"params/{program.name}/{name}.yaml"


def _has_find(value: Parameter) -> bool:
    if isinstance(value, Mapping):
        return any(map(_has_find, value.values()))
    if isinstance(value, (tuple, list)):
        return any(map(_has_find, value))
    return isinstance(value, str) and FIND.search(value) is not None


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
    found, declared = dict(program_parts.environment_of(swarm, program)), program.declared
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
    container, lifecycle = program.declared.container, program.declared.lifecycle
    forever = lifecycle == "service" and container is None
    text = render(
        "program.service",
        **service_values(swarm, host),
        program=program.name,
        packages=packages,
        command=as_client(swarm, command_of(swarm, program), forever=forever),
        ends_together=False,
        runtime=names.runtime_folder(swarm.name, program.name),
        memory_mb=program.declared.memory_mb,
        shipped=program.declared.use is not None,
        container=container_name(swarm, program) if container is not None else "",
        engine=container.engine if container is not None else "",
        lifecycle=lifecycle,
        trial_file=trial_file(name),
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
    unit = Unit(
        name, tuple(needs), program=program.name, packages=packages, secrets=secrets,
        in_trials=lifecycle == "trial",
    )  # fmt: skip
    return Part((file,), (unit,))


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
