"""The kinds of links by name, and the annotations of what a spec or a robot type may have of them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, TypeVar, Union

from pydantic import (
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    TypeAdapter,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
)

from swarmctl.field_types import Model
from swarmctl.links.link_base import Line, NetworkLink, RobotLink
from swarmctl.plugins import LINK_KINDS, NameIn

L = TypeVar("L", bound=Model)


def kinds(base: type[L]) -> Iterator[tuple[str, type[L]]]:
    """Yields the kinds of links whose class is a ``base``, built-in ones first, each with its class."""
    for name in LINK_KINDS:
        if issubclass(model := LINK_KINDS.get(name), base):
            yield name, model


class _KindsOf:
    """The names of the kinds whose class is a ``base``."""

    def __init__(self, base: type[Model]) -> None:
        self._base = base

    def names(self) -> tuple[str, ...]:
        return tuple(name for name, _ in kinds(self._base))

    def __contains__(self, name: object) -> bool:
        return name in LINK_KINDS and issubclass(LINK_KINDS.get(str(name)), self._base)


class OfAnyKind:
    """Annotation of a link: kinds that are not built in are validated by their own classes."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> Any:
        schema = WrapValidator(self._checked).__get_pydantic_core_schema__(source, handler)
        return {**schema, "serialization": {"type": "any"}}

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return handler(_adapter(self.classes()).core_schema)

    @staticmethod
    def classes() -> tuple[type[Model], ...]:
        """Returns the classes of all kinds."""
        return tuple(model for _, model in kinds(Model))

    def _checked(self, value: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
        kind = value.get("kind") if isinstance(value, dict) else None
        if not isinstance(kind, str) or kind in LINK_KINDS.built_in or kind not in LINK_KINDS:
            return handler(value)
        return _adapter(self.classes()).validate_python(value, context=info.context)


def _union(classes: tuple[type[Model], ...]) -> Any:
    return Annotated[Union[classes], Field(discriminator="kind")]  # noqa: UP007  (as many as there are)


@cache
def _adapter(classes: tuple[type[Model], ...]) -> TypeAdapter[Any]:
    return TypeAdapter(_union(classes))


RobotLinkKind = Annotated[str, NameIn(_KindsOf(RobotLink))]
LineKind = Annotated[str, NameIn(_KindsOf(Line))]
if TYPE_CHECKING:
    Link = NetworkLink | RobotLink
else:
    Link = Annotated[_union(tuple(map(LINK_KINDS.get, LINK_KINDS.built_in))), OfAnyKind()]
