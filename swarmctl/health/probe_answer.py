"""The probe's answer, of whose type ``answer_check`` has made sure, as frozen values of bounded size."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import is_dataclass, replace
from itertools import islice
from types import UnionType
from typing import Any, get_args, get_origin

from swarmctl.health.observations import Answer
from swarmctl.remote.answer_check import types_of

_LONGEST_TEXT = 300
_MOST = 20_000  # entries of one list or mapping


def answer_of(data: Mapping[str, Any], received: float | None = None) -> Answer:
    """Returns a ``ProbeAnswer`` as values. ``received``: the operator's clock when it came, s."""
    histories, stopped = data.get("history") or {}, data.get("stopped") or {}
    units = {
        name: {**unit, **histories.get(name, {}), "stopped": stopped.get(name)}
        for name, unit in (data.get("units") or {}).items()
    }
    launched = {
        unit: {**one, "nodes": _nodes(one), "started": list(one.get("starts", ()))}
        for unit, one in data.get("launched", {}).items()
    }
    graph = data.get("graph")
    answer: Answer = _value(Answer, {
        **data,
        "units": units,
        "nodes": _nodes(data),
        "launched": launched,
        "graph": {**graph, "foreign": graph["strangers"]} if graph else None,
    })  # fmt: skip
    time = data.get("time")
    return answer if time is None or received is None else replace(answer, clock_ahead=time - received)


def _nodes(data: Mapping[str, Any]) -> dict[str, Any]:
    nodes = data.get("nodes", {}).items()
    return {name: {**node, "report": _report(node.get("reports"))} for name, node in nodes}


def _report(statuses: list[dict[str, Any]] | None) -> dict[str, Any] | None:
    """The worst of a driver's statuses."""
    if not statuses:
        return None
    worst = max(statuses, key=lambda one: one["level"])
    values = worst["values"]
    nodes = values.get("refused nodes", "more").split()
    return {
        "level": worst["level"],
        "message": worst["message"],
        "commander": values.get("commander"),
        "refused": [one for one in nodes if one.startswith("/")],
        "refused_all": all(one.startswith("/") for one in nodes),
        "strangers": values.get("unauthorised senders"),
    }


def _value(kind: Any, data: Any) -> Any:
    """JSON as a value of the type ``kind``. What is missing or null in an object has its default."""
    if isinstance(kind, type) and is_dataclass(kind):
        types = types_of(kind)
        given = ((name, one) for name, one in data.items() if name in types and one is not None)
        return kind(**{name: _value(types[name], one) for name, one in given})
    origin, inner = get_origin(kind), get_args(kind)
    if origin is UnionType:
        return _value(inner[0], data)
    if origin is Mapping:
        return {name[:_LONGEST_TEXT]: _value(inner[1], one) for name, one in islice(data.items(), _MOST)}
    if origin is tuple:
        return tuple(_value(inner[0], one) for one in data[:_MOST])
    return data[:_LONGEST_TEXT] if kind is str else data
