"""Parameters of the programs that swarmctl ships, from the file that these programs read themselves."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import yaml

from swarmctl import resources
from swarmctl.field_types import Parameter


@dataclass(frozen=True)
class Setting:
    """One setting. It takes what is of its default's type; whole numbers pass as numbers."""

    default: int | float | str
    meaning: str
    unit: str = ""
    min: float = -math.inf
    max: float = math.inf
    pattern: str = ""
    example: str = ""

    def takes(self, value: Parameter) -> bool:
        """Returns True if ``value`` has the setting's type and is within its bounds."""
        if isinstance(value, bool) or not isinstance(value, (int, float, str)):
            return False
        if isinstance(self.default, str) or isinstance(value, str):
            text = isinstance(self.default, str) and isinstance(value, str)
            return text and re.fullmatch(self.pattern, str(value)) is not None
        whole = isinstance(value, int) or isinstance(self.default, float)
        return whole and self.min <= value <= self.max

    @property
    def range(self) -> str:
        """What it takes, in words."""
        if isinstance(self.default, str):
            return f"text such as {self.example}"
        kind = "a whole number" if isinstance(self.default, int) else "a number"
        return f"{kind} from {self.min:g} to {self.max:g} {self.unit}".rstrip()


@cache
def shipped() -> Mapping[str, Mapping[str, Setting]]:
    """Returns the settings of shipped programs by name (swarm_onboard/teleop/settings.yaml)."""
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    data = yaml.load((resources.onboard() / "teleop/settings.yaml").read_text("utf-8"), loader)
    return {
        program: {name: Setting(**fields) for name, fields in settings.items()}
        for program, settings in data.items()
    }
