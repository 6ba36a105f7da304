"""The parameters of a program's node, as roslaunch loads them. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from swarmctl.field_types import Parameter
from swarmctl.render.bundle import File
from swarmctl.render.own_program_files import own_files, params_path
from swarmctl.render.service_values import home
from swarmctl.render.yaml_params import params_file
from swarmctl.robot_types.ros_launchable import filled
from swarmctl.ros_packages.launch_files import FIND
from swarmctl.swarm.program_values import values_of
from swarmctl.swarm.resolved import Program, Swarm


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
