"""The protocol class beside a robot type: checked as text, never run on the operator's machine."""

from __future__ import annotations

import ast
import math
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path

from swarmctl.diagnostics import Diagnostic, Note, Span
from swarmctl.robot_types.protocols import PythonProtocol
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.suggest import did_you_mean
from swarmctl.yamltext.files import Read, text_of
from swarmctl.yamltext.limits import LoadBudget
from swarmctl.yamltext.source import Source

_PYTHON = (3, 8)  # of ROS noetic (REP 3)
#: What the driver calls, and the arguments it gives.
METHODS: Mapping[str, tuple[str, ...]] = {
    "__init__": ("options",),
    "speed": ("left", "right"),
    "query": ("name",),
    "actuator": ("actuator", "index", "values"),
    "identify": (),
}


def codec_beside(file: Path) -> Path:
    """Where the class of the robot type in ``file`` stands."""
    return file.with_suffix(".py")


def read_codec(source: Source, robot_type: RobotType, read: Read) -> tuple[bytes, list[Diagnostic]]:
    """The file of a type's protocol class, and what is wrong with it; nothing for a type that has none."""
    protocol = robot_type.protocol
    if not isinstance(protocol, PythonProtocol):
        return b"", []
    file = codec_beside(Path(source.path))
    declared_at = source.span(("protocol", "codec"))
    if not file.is_file():
        return b"", [_missing(file, protocol, declared_at)]
    text = text_of(file, LoadBudget(), read)
    if isinstance(text, Diagnostic):
        return b"", [text]
    return text.encode(), list(_wrong(text, str(file), robot_type, protocol, declared_at))


def _missing(file: Path, protocol: PythonProtocol, declared_at: Span) -> Diagnostic:
    return Diagnostic(
        "CODEC001",
        f"there is no file `{file}` with the class `{protocol.codec}`",
        declared_at,
        label="the class stands beside the type",
        help=(f"`swarmctl driver new {file.stem} --protocol python` writes one to begin with",),
    )


def _wrong(
    text: str, path: str, robot_type: RobotType, protocol: PythonProtocol, declared_at: Span
) -> Iterator[Diagnostic]:
    tree = _parsed(text, path)
    if isinstance(tree, Diagnostic):
        yield tree
        return
    classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
    found = classes.get(protocol.codec)
    if found is None:
        yield Diagnostic(
            "CODEC001",
            f"there is no class `{protocol.codec}` in `{path}`",
            declared_at,
            help=did_you_mean(protocol.codec, classes, "its classes are")
            or (f"begin with: class {protocol.codec}:",),
        )
        return
    yield from _method_errors(found, path, _wanted(robot_type, protocol), declared_at)


def _parsed(text: str, path: str) -> ast.Module | Diagnostic:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return ast.parse(text, path, feature_version=_PYTHON)
    except SyntaxError as error:
        line, column = max(error.lineno or 1, 1), max(error.offset or 1, 1)
        return Diagnostic(
            "CODEC002",
            f"this is no Python 3.8: {error.msg}",
            Span(path, line, column, line, column + 1),
            help=("robots with ROS noetic have Python 3.8; write it so that it runs there",),
        )
    except (ValueError, RecursionError, MemoryError) as error:
        return Diagnostic("CODEC002", f"`{path}` is no Python: {error}", Span(path, 1, 1, 1, 1))


def _wanted(robot_type: RobotType, protocol: PythonProtocol) -> Iterator[str]:
    """The methods that the driver will call."""
    yield from ("__init__", "speed")
    if protocol.queries:
        yield "query"
    if robot_type.actuators:
        yield "actuator"
    if protocol.identify:
        yield "identify"


def _method_errors(
    found: ast.ClassDef, path: str, wanted: Iterator[str], declared_at: Span
) -> Iterator[Diagnostic]:
    """Yields the methods that the class lacks; not for a class with bases, which may inherit them."""
    methods = {node.name: node for node in found.body if isinstance(node, ast.FunctionDef)}
    for name in wanted:
        signature = f"def {name}({', '.join(('self', *METHODS[name]))})"
        method = methods.get(name)
        if method is not None and not method.decorator_list and not _takes(method, len(METHODS[name])):
            yield Diagnostic(
                "CODEC003",
                f"the driver gives `{name}` other arguments",
                _span(method, path, f"def {name}"),
                help=(f"write it as: {signature}",),
            )
        elif method is None and not found.bases:
            yield Diagnostic(
                "CODEC003",
                f"the class `{found.name}` has no method `{name}`",
                _span(found, path, f"class {found.name}"),
                notes=(Note(declared_at, "the driver of this type calls it"),),
                help=(f"add it: {signature}",),
            )


def _takes(method: ast.FunctionDef, count: int) -> bool:
    """Whether it can be called with ``self`` and so many arguments by position."""
    given, named = method.args, len(method.args.posonlyargs) + len(method.args.args)
    least, most = named - len(given.defaults), math.inf if given.vararg else named
    return least <= count + 1 <= most and None not in given.kw_defaults


def _span(node: ast.ClassDef | ast.FunctionDef, path: str, head: str) -> Span:
    column = node.col_offset + 1
    return Span(path, node.lineno, column, node.lineno, column + len(head))
