"""The probe's answer, of whose type ``answer_check`` has made sure, as frozen values of bounded size."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from swarmctl.health.host_checks import host_checks
from swarmctl.health.observations import Answer
from swarmctl.remote.agent_client import check_type
from swarmctl.remote.answer_check import value_of


def answer_of(data: Mapping[str, Any], received: float | None = None) -> Answer:
    """Returns a ``ProbeAnswer`` as values. ``received``: the operator's clock when it came, s.

    Raises ``HostError`` if a check of the host reports what it cannot.
    """
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
    answer: Answer = value_of(Answer, {
        **data,
        "units": units,
        "nodes": _nodes(data),
        "launched": launched,
        "checks": {name: _seen(name, found) for name, found in data.get("checks", {}).items()},
        "graph": {**graph, "foreign": graph["strangers"]} if graph else None,
    })  # fmt: skip
    time = data.get("time")
    return answer if time is None or received is None else replace(answer, clock_ahead=time - received)


def _seen(check: str, found: list[Any]) -> list[Any]:
    if check not in host_checks():
        return []
    kind = host_checks()[check].Seen
    check_type(found, list[kind], f"what the host observed for `{check}`")  # type: ignore[valid-type]
    return [value_of(kind, one) for one in found]


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
