"""How a spec refers to a secret."""

from __future__ import annotations

from pydantic import Field

from swarmctl.field_types import Model, Name


class Secret(Model):
    """A secret by name; its value never stands in a spec."""

    secret: Name = Field(description="The name under which the secret is kept.", examples=["epuck-pin"])
