"""Which conditions of a unit's file are not met (systemd.unit(5)). Knows those that swarmctl writes."""

from __future__ import annotations

import os
import re

from . import files

_CONDITION = re.compile(rb"^(ConditionPathExists|ConditionFileIsExecutable)=(/[^\n]{1,200})$", re.MULTILINE)
_MOST = 10


def unmet(path: str) -> list[str]:
    """Returns the conditions in the unit's file at ``path`` that are not met now, such as ``NAME=/PATH``."""
    content = files.read(path) if path else None
    found = []
    for name, place in _CONDITION.findall(content or b""):
        executable = name == b"ConditionFileIsExecutable"
        met = os.path.isfile(place) and os.access(place, os.X_OK) if executable else os.path.exists(place)
        if not met:
            found.append(f"{name.decode()}={place.decode('utf-8', 'replace')}")
    return found[:_MOST]
