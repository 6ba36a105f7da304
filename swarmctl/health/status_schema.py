"""The JSON Schema of what ``status --json`` prints, made from the types of its values."""

from __future__ import annotations

from typing import Any, Literal, get_type_hints

from pydantic import BaseModel, create_model

from swarmctl.health.root_cause import Finding
from swarmctl.health.swarm_health import HostRow

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def status_schema() -> dict[str, Any]:
    """Returns the schema, in draft 2020-12."""
    finding = _model("Finding", {**get_type_hints(Finding), "key": str})
    keys = {"v": Literal[1], "swarm": str, "healthy": bool, "hosts": list[HostRow], "findings": list[finding]}  # type: ignore[valid-type]
    return {"$schema": DIALECT, **_model("Status", keys).model_json_schema(mode="serialization")}


def _model(name: str, keys: dict[str, Any]) -> type[BaseModel]:
    fields: dict[str, Any] = {key: (kind, ...) for key, kind in keys.items()}
    return create_model(name, **fields)
