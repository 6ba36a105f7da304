"""The protocol class beside a robot type: checked as text of limited size, which is not run here."""

from __future__ import annotations

import ast
import math
import os
import warnings
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from swarmctl.diagnostics import Diagnostic, Note, Span
from swarmctl.robot_types.protocols import PythonProtocol
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.suggest import did_you_mean
from swarmctl.yamltext.files import MAX_CODEC_BYTES, MAX_CODECS_BYTES
from swarmctl.yamltext.project_files import ProjectFiles
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


def read_codec(source: Source, robot_type: RobotType, files: ProjectFiles) -> tuple[bytes, list[Diagnostic]]:
    """The file of a type's protocol class, and what is wrong with it; nothing for a type that has none."""
    protocol = robot_type.protocol
    if not isinstance(protocol, PythonProtocol):
        return b"", []
    file, declared_at = codec_beside(Path(source.path)), source.span(("protocol", "codec"))
    if not os.path.lexists(file):
        message = f"there is no file `{file}` with the class `{protocol.codec}`"
        help_ = f"`swarmctl driver new {file.stem} --protocol python` writes one to begin with"
        label = "the class stands beside the type"
        return b"", [Diagnostic("CODEC001", message, declared_at, label=label, help=(help_,))]
    text = files.text(file, (".py",))
    if isinstance(text, Diagnostic):
        return b"", [replace(text, span=text.span or declared_at)]
    size = len(text.encode())
    if size > MAX_CODEC_BYTES:
        limit = f"{MAX_CODEC_BYTES >> 10} KiB, the limit for a protocol class"
        return b"", [Diagnostic("FILE002", f"`{file}` is larger than {limit}", declared_at)]
    files.budget.codec_bytes -= size
    if files.budget.codec_bytes < 0:
        limit = f"{MAX_CODECS_BYTES >> 10} KiB, the limit for all protocol classes"
        message = f"`{file}` and the classes before it are larger than {limit}"
        return b"", [Diagnostic("FILE002", message, declared_at)]
    classes = _classes(text, str(file))
    if isinstance(classes, Diagnostic):
        return text.encode(), [classes]
    if protocol.codec not in classes:
        message = f"there is no class `{protocol.codec}` in `{file}`"
        likely = did_you_mean(protocol.codec, classes, "its classes are")
        help_ = f"begin with: class {protocol.codec}:"
        return text.encode(), [Diagnostic("CODEC001", message, declared_at, help=likely or (help_,))]
    called = {"query": protocol.queries, "actuator": robot_type.actuators, "identify": protocol.identify}
    wanted = [name for name in METHODS if called.get(name, True)]
    return text.encode(), list(_method_errors(classes[protocol.codec], str(file), wanted, declared_at))


def _classes(text: str, path: str) -> dict[str, ast.ClassDef] | Diagnostic:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(text, path, feature_version=_PYTHON)
    except (SyntaxError, ValueError) as error:  # a null byte is a ValueError before Python 3.11.4
        place = error if isinstance(error, SyntaxError) else SyntaxError(str(error))
        line, column = max(place.lineno or 1, 1), max(place.offset or 1, 1)
        message = f"this is not Python 3.8: {place.msg}"
        help_ = "robots with ROS noetic have Python 3.8; write it so that it runs there"
        return Diagnostic("CODEC002", message, Span(path, line, column, line, column + 1), help=(help_,))
    except (RecursionError, MemoryError) as error:
        return Diagnostic("CODEC002", f"`{path}` is not Python: {error}", Span(path, 1, 1, 1, 1))
    return {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}


def _method_errors(
    found: ast.ClassDef, path: str, wanted: Iterable[str], declared_at: Span
) -> Iterator[Diagnostic]:
    """Yields the methods that the class lacks; not for a class with bases, which may inherit them."""
    methods = {node.name: node for node in found.body if isinstance(node, ast.FunctionDef)}
    for name in wanted:
        signature = f"def {name}({', '.join(('self', *METHODS[name]))})"
        method = methods.get(name)
        if method is not None and not method.decorator_list and not _takes(method, len(METHODS[name])):
            span, help_ = _span(method, path, f"def {name}"), f"write it as: {signature}"
            yield Diagnostic("CODEC003", f"the driver gives `{name}` other arguments", span, help=(help_,))
        elif method is None and not found.bases:
            message = f"the class `{found.name}` has no method `{name}`"
            span, help_ = _span(found, path, f"class {found.name}"), f"add it: {signature}"
            notes = (Note(declared_at, "the driver of this type calls it"),)
            yield Diagnostic("CODEC003", message, span, notes=notes, help=(help_,))


def _takes(method: ast.FunctionDef, count: int) -> bool:
    """Whether it can be called with ``self`` and so many arguments by position."""
    given, named = method.args, len(method.args.posonlyargs) + len(method.args.args)
    least, most = named - len(given.defaults), math.inf if given.vararg else named
    return least <= count + 1 <= most and None not in given.kw_defaults


def _span(node: ast.ClassDef | ast.FunctionDef, path: str, head: str) -> Span:
    column = node.col_offset + 1
    return Span(path, node.lineno, column, node.lineno, column + len(head))
