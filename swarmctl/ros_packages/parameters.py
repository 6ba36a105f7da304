"""The parameters of a node as their readers take them: rosparam of ROS 1, rcl of ROS 2. Pure.

rcl: `rcl_yaml_param_parser/src/parse.c` of ros2/rcl; its numbers are those of strtol and strtod. rosparam:
`rosparam/__init__.py` of ros_comm, behind which XML-RPC carries the values to the master.
"""

from __future__ import annotations

import ast
import math
import operator
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from datetime import datetime
from typing import Any, ClassVar, Literal, NamedTuple

import yaml

Loc = tuple[str | int, ...]
Reader = Literal["rcl", "rosparam"]

_WORDS = {
    form: value
    for value, words in ((True, "y yes true on"), (False, "n no false off"))
    for word in words.split()
    for form in (word, word.capitalize(), word.upper())
}
_INTEGER = re.compile(r"[-+]?(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)", re.ASCII)
_DECIMAL = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)(e[-+]?[0-9]+)?", re.ASCII | re.IGNORECASE)
_HEXADECIMAL = re.compile(
    r"[-+]?0x([0-9a-f]+\.?[0-9a-f]*|\.[0-9a-f]+)(p[-+]?[0-9]+)?", re.ASCII | re.IGNORECASE
)
_NO_NUMBER = re.compile(r"[-+]?(?:\.?(inf)|(inf)inity|\.?(nan)|nan\([a-z0-9_]*\))", re.ASCII | re.IGNORECASE)
_LONGEST = 100  # characters of a whole number, far beyond 64 bits
_BITS = {"rcl": 64, "rosparam": 32}
_WHOSE = {"rcl": "ROS 2", "rosparam": "ROS 1"}


def rcl_value(text: str) -> bool | int | float | str:
    """Returns what rcl reads where a text stands without quotes."""
    if text in _WORDS:
        return _WORDS[text]
    if len(text) < _LONGEST and _INTEGER.fullmatch(text):
        digits = text.lstrip("+-")
        base = 16 if digits[:2] in ("0x", "0X") else 8 if digits[0] == "0" else 10
        value = int(text.replace(digits, digits[2:] if base == 16 else digits), base)
        if fits(value, 64):
            return value
    return _double(text)


def _double(text: str) -> float | str:
    """A number as strtod takes it; text where that is beyond what a double can be."""
    if found := _NO_NUMBER.fullmatch(text):
        number = math.inf if found[1] or found[2] else math.nan
        return -number if text[0] == "-" else number
    try:
        if found := _DECIMAL.fullmatch(text):
            value = float(text)
        elif found := _HEXADECIMAL.fullmatch(text):
            value = float.fromhex(text)
        else:
            return text
    except OverflowError:
        return text
    is_zero = not found[1].strip("0.")
    return value if is_zero or sys.float_info.min <= abs(value) <= sys.float_info.max else text


def fits(value: int, bits: int) -> bool:
    """Returns whether a signed integer of so many bits holds ``value``."""
    return -(1 << bits - 1) <= value < 1 << bits - 1


def for_rcl(params: Mapping[str, Any]) -> dict[str, Any]:
    """Returns parameters as rcl reads them right.

    A list with decimals has no whole numbers, no mapping is empty, and none has a name with a dot: after
    such a one rcl gives the next parameters other names.
    """
    found: dict[str, Any] = {}
    for key, value in params.items():
        if isinstance(value, Mapping):
            below = for_rcl(value)
            found.update(_named(key, below) if "." in key or not below else {key: below})
        elif isinstance(value, (list, tuple)) and {type(one) for one in value} == {int, float}:
            found[key] = [float(one) for one in value]
        else:
            found[key] = value
    return found


def _named(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """The parameters of a mapping by their full names."""
    if isinstance(value, Mapping):
        for key, one in value.items():
            yield from _named(f"{name}.{key}", one)
    else:
        yield name, value


class Refusal(NamedTuple):
    """A value that a node does not get as it is written, by its place; ``help`` begins with a verb."""

    loc: Loc
    message: str
    help: str


def refusals(params: Mapping[str, Any], reader: Reader) -> Iterator[Refusal]:
    """Yields what ``reader`` refuses or reads as something else of the parameters of a node, by name."""
    names: dict[str, Loc] = {}
    yield from _of_mapping(params, reader, (), (), names)


def _of_mapping(
    params: Mapping[Any, Any], reader: Reader, loc: Loc, outer: tuple[str, ...], names: dict[str, Loc]
) -> Iterator[Refusal]:
    between = "." if reader == "rcl" else "/"
    for key, value in params.items():
        here: Loc = (*loc, key)
        if not isinstance(key, str) or not key:
            yield Refusal(
                here, f"`{key}` is no name of a parameter", "write a name, which begins with a letter"
            )
            continue
        name = between.join((*outer, key))
        if name in names:
            first = between.join(map(str, names[name]))
            yield Refusal(
                here, f"`{name}` is given twice, and in two forms", f"remove one: `{first}` is the other"
            )
        names.setdefault(name, here)
        if not isinstance(value, Mapping):
            yield from _of_value(value, reader, here)
        else:
            yield from _of_mapping(value, reader, here, (*outer, key), names)


def _of_value(value: Any, reader: Reader, loc: Loc) -> Iterator[Refusal]:
    if isinstance(value, (list, tuple)):
        yield from _of_list(value, loc) if reader == "rcl" else _items(value, loc)
    elif isinstance(value, Mapping):  # in a list of ROS 1
        for key, one in value.items():
            if not isinstance(key, str):
                yield Refusal((*loc, key), f"the name `{key}` is no text", "put it into quotes")
            yield from _of_value(one, reader, (*loc, key))
    elif isinstance(value, int) and not isinstance(value, bool):
        if not fits(value, _BITS[reader]):
            message = (
                f"{value} does not fit into the {_BITS[reader]} bits of a whole number in {_WHOSE[reader]}"
            )
            yield Refusal(loc, message, "write it as a decimal, or as text in quotes")
    elif isinstance(value, float):
        if reader == "rcl" and 0 < abs(value) < sys.float_info.min:
            yield Refusal(loc, f"{value!r} is so small that rcl reads it as text", "write 0.0")
    elif not isinstance(value, (bool, str, bytes, datetime) if reader == "rosparam" else (bool, str)):
        what = "null" if value is None else f"a value of type {type(value).__name__}"
        yield Refusal(loc, f"{what} is no parameter", "put it into quotes")


def _items(value: list[Any] | tuple[Any, ...], loc: Loc) -> Iterator[Refusal]:
    for index, one in enumerate(value):
        yield from _of_value(one, "rosparam", (*loc, index))


_KINDS: dict[type, str] = {bool: "true or false", int: "numbers", float: "numbers", str: "texts"}


def _of_list(value: list[Any] | tuple[Any, ...], loc: Loc) -> Iterator[Refusal]:
    """What rcl refuses of a list: it has items of one type, and at least one, which gives it its type."""
    own_file = "let the node read a file of its own: files: {NAME.yaml: PATH}"
    if not value:
        yield Refusal(loc, "an empty list has no type, and ROS 2 refuses it", "leave it out")
    first = _KINDS.get(type(value[0])) if value else None
    for index, one in enumerate(value):
        kind = _KINDS.get(type(one))
        if isinstance(one, (list, tuple, Mapping)):
            what = "mapping" if isinstance(one, Mapping) else "list"
            yield Refusal((*loc, index), f"a {what} in a list is no parameter of ROS 2", own_file)
            return
        if kind != first and kind and first:
            message = f"a list of ROS 2 has items of one type: here are {first} and {kind}"
            yield Refusal((*loc, index), message, "put all into quotes, or write two lists")
            return
        yield from _of_value(one, "rcl", (*loc, index))


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
