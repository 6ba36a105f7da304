"""What may stand at a place of a model, as far as its types and examples show."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from enum import Enum
from typing import Any, get_args, get_origin

from pydantic import BaseModel

from swarmctl.spec.model_lookup import TAGS, is_model, known_keys, types_at, unwrapped


def likely_kinds(given: Any, kinds: tuple[str, ...]) -> list[str]:
    """Returns the kinds that have most of the keys of ``given``."""
    keys = set(given) if isinstance(given, dict) else set()
    shared = {kind: len(keys & set(TAGS[kind].model_fields)) for kind in kinds}
    return [kind for kind in kinds if shared[kind] == max(shared.values())]


def stand_ins(loc: tuple[str | int, ...], model: type[BaseModel], number: int) -> tuple[list[Any], bool]:
    """Returns values that may stand at ``loc`` of a ``model``, likely ones first; True if it may be left out.

    ``number`` makes those that are names differ. A mapping or list is empty, and lacks what it needs.
    """
    holders = [place for place in types_at(loc[:-1], model) if is_model(place)]
    fields = [field for place in holders if (field := place.model_fields.get(str(loc[-1]))) is not None]
    annotations = [field.annotation for field in fields] or _items(loc, model)
    examples = [one for field in fields for one in field.examples or ()]
    examples += [one for annotation in annotations for one in _examples(annotation)]
    kinds = [one for annotation in annotations for one in unwrapped(annotation)]
    simple = [value for kind in kinds for value in _simple(kind, number)]
    return [*simple, *examples], bool(fields) and not any(field.is_required() for field in fields)


def absent_keys(loc: tuple[str | int, ...], model: type[BaseModel], given: Collection[str]) -> list[str]:
    """Returns the keys at ``loc`` of a ``model`` that are not in ``given``."""
    return [key for key in known_keys(loc, model) if key not in given]


def most_alike(
    given: Any, loc: tuple[str | int, ...], names: Iterable[str], model: type[BaseModel]
) -> list[str]:
    """Returns the keys of ``names`` at ``loc`` that take most of the keys in ``given``, or in its entries."""
    entries = tuple(given.values()) if isinstance(given, dict) else given
    within = {key for entry in entries if isinstance(entry, dict) for key in entry}
    shared: dict[str, int] = {}
    for name in names:
        own = [key for key in known_keys((*loc, name), model) if key in given]
        shared[name] = max(len(own), len(set(known_keys((*loc, name, 0), model)) & within))
    most = max(shared.values(), default=0)
    return [name for name, count in shared.items() if count == most > 0]


def _items(loc: tuple[str | int, ...], model: type[BaseModel]) -> list[Any]:
    """The annotations of the items or values of what stands above ``loc``."""
    holders = [place for place in types_at(loc[:-1], model) if get_args(place)]
    return [get_args(one)[1 if get_origin(one) in (dict, Mapping) else 0] for one in holders]


def _examples(annotation: Any) -> list[Any]:
    parts = getattr(annotation, "__metadata__", ())
    own = [one for part in parts for one in getattr(part, "examples", None) or ()]
    below = () if get_origin(annotation) in (tuple, list, dict, Mapping) else get_args(annotation)
    return [*own, *(one for argument in below for one in _examples(argument))]


def _simple(kind: Any, number: int) -> list[Any]:
    if is_model(kind):
        return [{}]
    if isinstance(kind, type) and issubclass(kind, Enum):
        return [one.value for one in kind]
    if isinstance(kind, (str, int)):  # of a Literal
        return [kind]
    if get_origin(kind) in (dict, Mapping):
        return [{}]
    by_type: dict[Any, Any] = {str: f"standin{number}", int: 1, float: 1.0, bool: False}
    return [by_type.get(kind, [])]
