"""A text that has every field of a model, each on a line of its own, and wrong values to put in its place."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, TypeAdapter

from swarmctl.plugins import NameIn
from swarmctl.units import Unit

Loc = tuple[str | int, ...]

_ANY = ("null", "true", "-7", "7.5", "rubbish", '""', "2026-01-01", "[]", "[1, two]", "{}", "{one: 1}")
_SCALARS = (
    "yes", "0", "1e300", "9" * 20, ".nan", "-.inf", "x" * 5000, '" "', '"\\t"', '"\\n"', '"a\\u00a0b"',
    "Ä ö!", '"12"', "1.2.3", "0,29", "12 parsecs", "5 kg", "0x1F",
)  # fmt: skip


@dataclass(frozen=True)
class Node:
    """A value of a text: a scalar as YAML, or its entries by key (None in lists).

    ``owner`` names the field of a model. Of its type, ``parts`` are metadata, ``words`` all that it can be.
    """

    owner: str
    text: str = ""
    entries: tuple[tuple[str | None, Node], ...] = ()
    parts: tuple[Any, ...] = ()
    words: tuple[str, ...] = ()
    own_names: bool = False  # True of a mapping whose keys are names of the user's

    def below(self, at: Loc = ()) -> Iterator[tuple[Loc, Node]]:
        """Yields every value below, outer ones first, with the steps to it."""
        for number, (key, one) in enumerate(self.entries):
            loc = (*at, number if key is None else key)
            yield loc, one
            yield from one.below(loc)

    @property
    def unit(self) -> Unit | None:
        """The unit of a number."""
        return next((one for one in self.parts if isinstance(one, Unit)), None)

    def bounds(self) -> dict[str, float]:
        """Returns the bounds of a value: gt, ge, lt, le, min_length, max_length."""
        names = ("gt", "ge", "lt", "le", "min_length", "max_length")
        given = ((name, getattr(part, name, None)) for part in self.parts for name in names)
        return {name: value for name, value in given if value is not None}


def samples(model: type[BaseModel]) -> list[Node]:
    """Returns values of ``model``, together with every field of it and of what it holds."""
    return _of_model(model, model.__name__)


def _of_model(model: type[BaseModel], owner: str) -> list[Node]:
    fields = {
        name: _of(one.annotation, (*one.metadata, one), f"{model.__name__}.{name}")
        for name, one in model.model_fields.items()
    }
    needed = {name for name, one in model.model_fields.items() if one.is_required()}
    return [
        Node(owner, entries=tuple(
            (name, nodes[number % len(nodes)])
            for name, nodes in fields.items()
            if number == 0 or name in needed or len(nodes) > 1
        ))
        for number in range(max(map(len, fields.values())))
    ]  # fmt: skip


def _of(annotation: Any, parts: tuple[Any, ...], owner: str) -> list[Node]:
    """The values of one type, one for each of its alternatives that are models."""
    if hasattr(annotation, "__metadata__"):
        return _of(annotation.__origin__, (*_flat(annotation.__metadata__), *parts), owner)
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin in (Union, UnionType):
        kinds = [one for one in arguments if one is not type(None)]
        nodes = [node for one in kinds for node in _of(one, parts, owner)]
        return nodes if all(map(_is_model, kinds)) else nodes[:1]
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return _of_model(annotation, owner)
    if origin in (dict, Mapping):
        return [_mapping(*arguments, parts, owner)]
    if origin is tuple:
        kinds = [
            (one, node) for one in arguments if one is not Ellipsis for node in _of(one, (), f"{owner}[]")
        ]
        return [Node(owner, entries=tuple((None, node) for _, node in kinds), parts=parts)]
    return [_scalar(annotation, parts, owner)]


def _is_model(annotation: Any) -> bool:
    while hasattr(annotation, "__metadata__"):
        annotation = annotation.__origin__
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def _flat(parts: tuple[Any, ...]) -> tuple[Any, ...]:
    """Metadata with that which pydantic keeps inside a ``Field``."""
    return tuple(one for part in parts for one in (part, *getattr(part, "metadata", ())))


def _mapping(key: Any, value: Any, parts: tuple[Any, ...], owner: str) -> Node:
    nodes = _of(value, (), f"{owner}{{}}")
    (name,) = _of(key, (), owner)
    if name.words:
        names = [*name.words[: len(nodes)]]
    else:
        first = json.loads(name.text)
        names = [first, *(f"{first}{number}" for number in range(2, len(nodes) + 1))]
    return Node(owner, entries=tuple(zip(names, nodes, strict=True)), parts=parts, own_names=True)


def _scalar(annotation: Any, parts: tuple[Any, ...], owner: str) -> Node:
    words: tuple[Any, ...] = ()
    if get_origin(annotation) is Literal:
        words = get_args(annotation)
    elif isinstance(annotation, type) and issubclass(annotation, Enum):
        words = tuple(one.value for one in annotation)
    elif chosen := next((one for one in parts if isinstance(one, NameIn)), None):
        schema = TypeAdapter(Annotated[str, chosen]).json_schema()
        words = tuple(schema.get("enum", [schema.get("const")]))
    examples = [one for part in parts for one in getattr(part, "examples", None) or ()]
    bounds = Node(owner, parts=parts).bounds()
    usual: dict[Any, Any] = {str: "ab", bool: True, int: bounds.get("ge", 1), float: bounds.get("ge", 1.0)}
    value = (*words, *examples, usual.get(annotation))[0]
    return Node(owner, json.dumps(value), parts=parts, words=tuple(map(str, words)))


def wrong_values(node: Node) -> Iterator[str]:
    """Yields values as YAML that are mostly wrong where ``node`` stands: other kinds, forms and spellings."""
    yield from _ANY if node.entries else (*_ANY, *_SCALARS)
    for word in node.words[:2]:
        yield from (json.dumps(word[:-1]), json.dumps(word.upper()), json.dumps(f"{word}s"))


def out_of_range(node: Node) -> Iterator[str]:
    """Yields values as YAML that are just too small, too large, too short or too long for ``node``."""
    for name, bound in node.bounds().items():
        step = -1 if name in ("gt", "ge", "min_length") else 1
        beyond = bound if name in ("gt", "lt") else bound + step
        if "length" not in name:
            yield json.dumps(beyond)
        elif beyond >= 0:
            yield json.dumps(["a"] * int(beyond) if node.entries else "7" * int(beyond))


@dataclass
class Written:
    """A text, and what each of its lines holds."""

    lines: list[str] = field(default_factory=list)
    places: dict[int, Loc] = field(default_factory=dict)

    @property
    def text(self) -> str:
        """The text as a file has it."""
        return "\n".join([*self.lines, ""])


def written(root: Node, values: Mapping[Loc, str], names: Mapping[Loc, str] = {}) -> Written:
    """Returns ``root`` as YAML, a line for each value, with other ``values`` and ``names`` of keys."""
    made = Written()
    _write(root, (), values, names, made)
    return made


def _write(node: Node, at: Loc, values: Mapping[Loc, str], names: Mapping[Loc, str], made: Written) -> None:
    for number, (key, one) in enumerate(node.entries):
        loc = (*at, number if key is None else key)
        head = "  " * len(at) + ("-" if key is None else f"{names.get(loc, key)}:")
        value = values.get(loc, one.text)
        made.lines.append(f"{head} {value}".rstrip())
        made.places[len(made.lines)] = loc
        if loc not in values and one.entries:
            _write(one, loc, values, names, made)
