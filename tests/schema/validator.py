"""The JSON Schemas as validators, each made once."""

from __future__ import annotations

from functools import cache
from typing import Any

import jsonschema

from swarmctl.schema.json_schema import schema_of


@cache
def _validator(name: str) -> jsonschema.Draft7Validator:
    return jsonschema.Draft7Validator(schema_of(name))


def valid(name: str, data: Any) -> bool:
    return _validator(name).is_valid(data)
