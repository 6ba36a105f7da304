"""Files of parameters, as rosparam loads them, or as rcl reads those of ROS 2. Pure."""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any, ClassVar, NamedTuple

import yaml

from swarmctl.ros_packages.parameters import Loc, Reader, rcl_value, refusals

#: What a file of ROS 2 has between the name of a node and its parameters.
PARAMETERS = "ros__parameters"

_MAX_DEPTH = 64  # libyaml composes recursively, on its stack
_SECTION = re.compile(r"/?((\*\*|\*|[A-Za-z_][A-Za-z0-9_]*)/)*(\*\*|\*|[A-Za-z_][A-Za-z0-9_]*)", re.ASCII)


class ParameterFileError(ValueError):
    """A file that cannot be loaded, with the line and the column, from 1."""

    def __init__(self, message: str, line: int, column: int, help_line: str) -> None:
        super().__init__(message)
        self.line, self.column, self.help = line, column, help_line


class ParameterFile(NamedTuple):
    """A file of parameters: ``values`` by name; or by the nodes that a file of ROS 2 is for."""

    values: Mapping[str, Any]
    nodes: Mapping[str, Mapping[str, Any]]


def read_file(content: bytes, reader: Reader) -> ParameterFile:
    """Returns what is in a file as ``reader`` takes it. Raises `ParameterFileError`.

    rcl itself reads files of ROS 2 only, which have `ros__parameters` below the names of nodes. Others are
    read as rosparam reads them, angles included.
    """
    text = _checked(content)
    root = _composed(text, _Rcl)
    if reader == "rcl" and _has_sections(root):
        aliases = (one for one in yaml.parse(text, _Rosparam) if isinstance(one, yaml.AliasEvent))
        for one in aliases:
            raise _error(one.start_mark, "rcl takes no aliases", "write the value itself")
        values = _constructed(text, _Rcl)
        nodes: dict[str, Mapping[str, Any]] = {}
        for loc, section in _sections(values, root):
            name = "/".join(map(str, loc))
            if not _SECTION.fullmatch(name):
                raise _error(_mark(root, loc), f"`{name}` is no name of a node", "write a name, or `/**`")
            for place in _empty(section, (*loc, PARAMETERS)):
                raise _error(_mark(root, place), "an empty mapping is none of rcl's values", "remove it")
            _raise_first(section, "rcl", root, (*loc, PARAMETERS))
            nodes[f"/{name.removeprefix('/')}"] = section
        return ParameterFile({}, nodes)
    values = _constructed(text, _Rosparam)
    _raise_first(values, reader, root, ())
    return ParameterFile(values, {})


def reads_section(section: str, node: str) -> bool:
    """Returns whether a node with the full name ``node`` reads a section of a file of ROS 2."""
    pattern = re.escape(section).replace(r"/\*\*", r"(/\w+)*").replace(r"/\*", r"(/\w+)")
    return re.fullmatch(pattern, node, re.ASCII) is not None


def _raise_first(values: Mapping[str, Any], reader: Reader, root: yaml.Node, loc: Loc) -> None:
    for one in refusals(values, reader):
        raise _error(_mark(root, (*loc, *one.loc)), one.message, one.help)


def _checked(content: bytes) -> str:
    """The text of a file, which is YAML and not so deep that libyaml runs out of its stack."""
    try:
        text, depth = content.decode("utf-8"), 0
        for event in yaml.parse(text, _Rosparam):
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if depth > _MAX_DEPTH:
                raise _error(event.start_mark, f"it is nested in more than {_MAX_DEPTH} levels", "write less")
    except yaml.MarkedYAMLError as error:
        raise _error(error.problem_mark, error.problem or "no YAML", "") from None
    except (yaml.YAMLError, UnicodeDecodeError):
        raise ParameterFileError("it is not text in YAML", 1, 1, "") from None
    return text


def _composed(text: str, loader: type[_Rosparam]) -> yaml.MappingNode:
    try:
        root = yaml.compose(text, loader)
    except yaml.MarkedYAMLError as error:
        raise _error(error.problem_mark, error.problem or "no YAML", "") from None
    if not isinstance(root, yaml.MappingNode):
        raise ParameterFileError("it is not a mapping", 1, 1, "")
    return root


def _constructed(text: str, loader: type[_Rosparam]) -> Any:
    try:
        return yaml.load(text, loader)
    except yaml.MarkedYAMLError as error:
        raise _error(error.problem_mark, error.problem or "no value", "write the value itself") from None
    except ValueError as error:  # the 13th month, or a number of thousands of digits
        raise ParameterFileError(f"a value cannot be read: {error}", 1, 1, "put it into quotes") from None


def _error(mark: Any, message: str, help_line: str) -> ParameterFileError:
    line, column = (mark.line, mark.column) if mark is not None else (0, 0)
    return ParameterFileError(message, line + 1, column + 1, help_line)


def _has_sections(node: yaml.Node) -> bool:
    return isinstance(node, yaml.MappingNode) and any(
        key.value == PARAMETERS or _has_sections(value) for key, value in node.value
    )


def _sections(values: Any, root: yaml.Node, loc: Loc = ()) -> Iterator[tuple[Loc, Mapping[str, Any]]]:
    for key, value in values.items():
        if key == PARAMETERS and loc and isinstance(value, Mapping):
            yield loc, value
        elif key == PARAMETERS or not isinstance(value, Mapping):
            message = f"a value that is not below a node and its `{PARAMETERS}`"
            raise _error(_mark(root, (*loc, key)), message, f"write NODE: {{{PARAMETERS}: {{NAME: VALUE}}}}")
        else:
            yield from _sections(value, root, (*loc, key))


def _empty(params: Mapping[str, Any], loc: Loc) -> Iterator[Loc]:
    for key, value in params.items():
        if isinstance(value, Mapping):
            yield from _empty(value, (*loc, key)) if value else [(*loc, key)]


def _mark(node: yaml.Node, loc: Loc) -> Any:
    """Where a value begins, or the innermost around it that is in the text."""
    for step in loc:
        below: Mapping[Any, Any] = {}
        if isinstance(node, yaml.MappingNode):
            below = {key.value: value for key, value in node.value if isinstance(key, yaml.ScalarNode)}
        elif isinstance(node, yaml.SequenceNode):
            below = dict(enumerate(node.value))
        if step not in below and str(step) not in below:
            break
        node = below[step] if step in below else below[str(step)]
    return node.start_mark


class _Rosparam(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """YAML as rosparam loads it: YAML 1.1, and angles."""


class _Rcl(_Rosparam):
    """YAML as rcl reads it: it has its own values, and no tag but that of texts."""

    yaml_implicit_resolvers: ClassVar[dict[str, Any]] = {}
    yaml_constructors: ClassVar[dict[str | None, Any]] = {
        tag: yaml.SafeLoader.yaml_constructors[tag]
        for tag in (f"tag:yaml.org,2002:{one}" for one in ("str", "seq", "map"))
    }

    def resolve(self, kind: type[yaml.Node], value: str, implicit: tuple[bool, bool] | bool) -> str:
        plain = kind is yaml.ScalarNode and isinstance(implicit, tuple) and implicit[0]
        return "!rcl" if plain else super().resolve(kind, value, implicit)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        for key, _ in node.value:
            if not isinstance(key, yaml.ScalarNode):
                raise yaml.constructor.ConstructorError(None, None, "a key is text", key.start_mark)
        return {key.value: self.construct_object(value, deep=True) for key, value in node.value}


def _rcl_scalar(loader: _Rcl, node: yaml.ScalarNode) -> Any:
    if not node.value:
        raise yaml.constructor.ConstructorError(None, None, "there is no value", node.start_mark)
    return rcl_value(node.value)


_OPERATORS: dict[type, Callable[..., float]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.USub: operator.neg, ast.UAdd: operator.pos,
}  # fmt: skip


def _evaluated(node: ast.AST) -> float:
    """The value of an arithmetic expression with `pi`; rosparam evaluates it as Python."""
    match node:
        case ast.Expression(body):
            return _evaluated(body)
        case ast.Constant(int() | float() as value):
            return value
        case ast.Name("pi"):
            return math.pi
        case ast.BinOp(left, sign, right) if type(sign) in _OPERATORS:
            return _OPERATORS[type(sign)](_evaluated(left), _evaluated(right))
        case ast.UnaryOp(sign, operand) if type(sign) in _OPERATORS:
            return _OPERATORS[type(sign)](_evaluated(operand))
    raise ValueError


def _angle(unit: str, in_radians: float) -> Callable[[Any, yaml.ScalarNode], float]:
    def construct(loader: Any, node: yaml.ScalarNode) -> float:
        text = loader.construct_scalar(node).strip()
        inner = text[4:-1] if text.startswith(f"{unit}(") else text
        try:
            return float(_evaluated(ast.parse(inner.strip(), mode="eval"))) * in_radians
        except (SyntaxError, ValueError, ArithmeticError, RecursionError):
            message = f"`{text}` is no angle"
            raise yaml.constructor.ConstructorError(None, None, message, node.start_mark) from None

    return construct


def _unknown(loader: Any, node: yaml.Node) -> Any:
    raise yaml.constructor.ConstructorError(None, None, f"the tag `{node.tag}` is unknown", node.start_mark)


_Rosparam.add_constructor(None, _unknown)
_Rcl.add_constructor(None, _unknown)
_Rcl.add_constructor("!rcl", _rcl_scalar)
for _unit, _tag, _factor in (("deg", "!degrees", math.pi / 180), ("rad", "!radians", 1.0)):
    _Rosparam.add_constructor(_tag, _angle(_unit, _factor))
    _Rosparam.add_implicit_resolver(_tag, re.compile(rf"{_unit}\([^)]*\)$"), [_unit[0]])
