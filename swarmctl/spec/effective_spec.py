"""The effective spec: every value at the entry that it applies to, with the layer that set it.

Layers go from general to special: swarmctl's own defaults, ``defaults``, the robot's type, the entry.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from pydantic import BaseModel

from swarmctl.diagnostics import Span
from swarmctl.robot_types.settings import merged
from swarmctl.spec.load import Document
from swarmctl.spec.model import Host
from swarmctl.yamltext.variables import KEY as VARS

DEFAULTS, OVERLAY, SWARMCTL = "defaults", "overlay", "swarmctl"

Place: TypeAlias = tuple[str | int, ...]
Scalar: TypeAlias = str | int | float | bool


@dataclass(frozen=True)
class Origin:
    """Where a value comes from: the layer, unless it is the entry itself, and the place, if it has one."""

    layer: str = ""
    span: Span | None = None


@dataclass(frozen=True)
class Flat:
    """A value with its origin: the most special layer that has it."""

    value: Mapping[str, Flat] | list[Flat] | Scalar
    origin: Origin


def flat(document: Document, overlays: Collection[str] = ()) -> Flat:
    """The whole spec without ``defaults`` and ``vars``, which are worked into what they are for.

    What stands in one of the files ``overlays`` has a layer of its own.
    """
    return _Reader(document, overlays).flat(_effective(document), (), [_Layer(document.source.data)])


def _effective(document: Document) -> dict[str, Any]:
    """What holds in the end, as plain data."""
    spec, given = document.spec, document.source.data
    of_entries = {section: {"__all__": {VARS}} for section in ("hosts", "robots", "programs")}
    done: Any = {DEFAULTS: True, VARS: True, **of_entries}
    data = spec.model_dump(mode="json", exclude_none=True, exclude=done)
    of_hosts = spec.defaults.host.model_dump(exclude_none=True)
    for name, host in data["hosts"].items():
        host |= {key: value for key, value in of_hosts.items() if key not in given["hosts"][name]}
        data["hosts"][name] = {key: host[key] for key in Host.model_fields if key in host}
    for name in spec.robots:
        settings = merged(*document.settings_layers(name))
        data["robots"][name]["settings"] = settings.model_dump(exclude_none=True)
    return data


@dataclass(frozen=True)
class _Layer:
    """The data of one layer, what it is called, and where it stands in the spec, if it stands there."""

    data: Any
    name: str = ""
    place: Place | None = ()

    def below(self, part: str | int) -> _Layer:
        place = None if self.place is None else (*self.place, part)
        if isinstance(self.data, Mapping):
            return _Layer(self.data.get(part), self.name, place)
        inside = isinstance(self.data, tuple) and isinstance(part, int)
        return _Layer(self.data[part] if inside else None, self.name, place)


@dataclass(frozen=True)
class _Reader:
    """One document while its flat form is made."""

    document: Document
    overlays: Collection[str]

    def flat(self, value: Any, place: Place, layers: Sequence[_Layer]) -> Flat:
        """What holds at one place; ``layers`` are those above it, the most special first."""
        general = [layer for layer in self._more_general(place) if layer.data]
        layers = [layer for layer in layers if layer.data is not None] + general
        origin = self._origin(layers)
        if isinstance(value, Mapping):
            parts = {key: self._below(one, place, key, layers) for key, one in value.items()}
            return Flat({key: one for key, one in parts.items() if not _is_unset(one)}, origin)
        if isinstance(value, list):
            return Flat([self._below(one, place, number, layers) for number, one in enumerate(value)], origin)
        return Flat(value, origin)

    def _below(self, value: Any, place: Place, part: str | int, layers: Sequence[_Layer]) -> Flat:
        return self.flat(value, (*place, part), [layer.below(part) for layer in layers])

    def _more_general(self, place: Place) -> list[_Layer]:
        """The layers that lie below the entry itself at one place of a spec, the most special first."""
        spec, defaults = self.document.spec, self.document.spec.defaults
        match place:
            case ("hosts", _):
                return [_Layer(_set_values(defaults.host), DEFAULTS, (DEFAULTS, "host"))]
            case ("robots", str() as name, "settings"):
                kind = spec.robots[name].type
                of_type = self.document.settings_layers(name)[1]
                own = ("types", kind, "settings") if kind in spec.types else None
                return [
                    _Layer(_set_values(of_type), f"type {kind}", own),
                    _Layer(_set_values(defaults.robot), DEFAULTS, (DEFAULTS, "robot")),
                ]
        return []

    def _origin(self, layers: Sequence[_Layer]) -> Origin:
        if not layers:
            return Origin(SWARMCTL)
        first = layers[0]
        span = None if first.place is None else self.document.source.span(first.place)
        overlay = not first.name and span is not None and span.file in self.overlays
        return Origin(OVERLAY if overlay else first.name, span)


def _set_values(model: BaseModel) -> dict[str, Any]:
    return model.model_dump(mode="json", exclude_defaults=True)


def _is_unset(one: Flat) -> bool:
    """True if this is empty and no layer sets it."""
    return one.value in ({}, [], "") and one.origin.layer == SWARMCTL
