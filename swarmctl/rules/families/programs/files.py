"""The files that programs get: they exist, are what their readers expect, and templates render."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import yaml

from swarmctl.diagnostics import Diagnostic, Span
from swarmctl.rules.context import RuleContext, rule
from swarmctl.spec.program_model import Program, Template
from swarmctl.swarm.file_templates import TemplateError, rendered
from swarmctl.swarm.program_values import template_values
from swarmctl.swarm.resolve import resolve
from swarmctl.swarm.resolved import Swarm
from swarmctl.yamltext.source import Loc


@rule("PROG028")
def found(context: RuleContext) -> Iterator[Diagnostic]:
    """A file that does not lie beside the spec, or cannot be read."""
    refused = context.document.files.refused
    for name, program in context.spec.programs.items() if refused else ():
        for loc, path in _paths(program):
            if path in refused:
                yield Diagnostic(
                    "PROG028",
                    f"`{path}` {refused[path]}",
                    context.span("programs", name, *loc),
                    label=f"a file of program `{name}`",
                    help=("write its path from the folder of the spec",),
                )


def _paths(program: Program) -> Iterator[tuple[Loc, str]]:
    for name, source in program.files.items():
        if isinstance(source, Template):
            yield ("files", name, "template"), source.template
        else:
            yield ("files", name), source
    for name, path in program.file_params.items():
        yield ("params", name, "file"), path


@rule("PROG029", ros1=True)
def parameters(context: RuleContext) -> Iterator[Diagnostic]:
    """A file of parameters that is no YAML mapping."""
    for name, program in context.spec.programs.items():
        for key, path in program.file_params.items():
            content = context.document.files.content.get(path)
            wrong = _no_parameters(content) if content is not None else None
            if wrong is not None:
                message, line, column = wrong
                yield Diagnostic(
                    "PROG029",
                    f"{path}:{line}:{column} cannot be loaded as parameters: {message}",
                    context.span("programs", name, "params", key, "file"),
                    label="rosparam refuses it",
                    help=("write `NAME: VALUE` on each line, as in a file for `rosparam load`",),
                )


def _no_parameters(content: bytes) -> tuple[str, int, int] | None:
    """What is wrong with a file for rosparam, its line and its column."""
    try:
        root = yaml.compose(content.decode("utf-8"), getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        return error.problem or "no YAML", (mark.line if mark else 0) + 1, (mark.column if mark else 0) + 1
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError):
        return "it is no text in YAML", 1, 1
    if not isinstance(root, yaml.MappingNode):
        return "it is no mapping", 1, 1
    return None


@rule("PROG030")
def templates(context: RuleContext) -> Iterator[Diagnostic]:
    """A template that cannot be rendered with the values of the spec."""
    used = [(name, one) for name, one in context.spec.programs.items() if _templates(one)]
    swarm = _swarm(context) if used else None
    for name, program in used if swarm is not None else ():
        for source in _templates(program):
            content = context.document.files.content.get(source.template)
            if content is None or swarm is None:
                continue
            values = template_values(swarm, swarm.programs[name])
            try:
                rendered(content, values)
            except TemplateError as error:
                file = str(Path(context.source.path).parent / source.template)
                yield Diagnostic(
                    "PROG030",
                    f"the template of program `{name}` cannot be rendered: {error}",
                    Span(file, error.line, error.column, error.line, error.column + 1),
                    label=f"with the values of host `{swarm.programs[name].host}`",
                    help=(f"it can use {', '.join(values)}", "`{% if NAME is defined %}` asks first"),
                )


def _templates(program: Program) -> list[Template]:
    return [one for one in program.files.values() if isinstance(one, Template)]


def _swarm(context: RuleContext) -> Swarm | None:
    """The resolved swarm; None where other rules have something to report first."""
    try:
        return resolve(context.document)
    except (ValueError, KeyError, StopIteration):
        return None


@rule("PROG031", ros1=True)
def arguments(context: RuleContext) -> Iterator[Diagnostic]:
    """An argument of a launch file, or a parameter of a shipped program, that is a list or a mapping."""
    for name, program in context.spec.programs.items():
        for key, value in program.params.items() if program.launch is not None else ():
            if not isinstance(value, (bool, int, float, str)):
                yield Diagnostic(
                    "PROG031",
                    f"`{key}` of program `{name}` is no argument of a launch file: arguments are text",
                    context.span("programs", name, "params", key, key=True),
                    label="a list, a mapping or a file",
                    help=(
                        "put it into a file: files: {NAME.yaml: PATH}",
                        f"and give its place: args: {{{key}: '{{files}}/NAME.yaml'}}",
                    ),
                )
