"""The files of a program that do not depend on ROS: what lies beside the spec, copied or rendered. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from swarmctl.render.bundle import File
from swarmctl.render.yaml_params import params_file
from swarmctl.spec.program_model import Template
from swarmctl.swarm.command_topics import STAMPED_TYPE, CommandTopic
from swarmctl.swarm.file_templates import rendered
from swarmctl.swarm.program_values import template_values
from swarmctl.swarm.resolved import Program, Swarm


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
