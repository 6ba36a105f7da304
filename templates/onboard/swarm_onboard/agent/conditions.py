"""Which conditions of a unit's file are not met (systemd.unit(5)). Knows those that swarmctl writes."""

from __future__ import annotations

import os

from . import files

_EXISTS, _EXECUTABLE = "ConditionPathExists", "ConditionFileIsExecutable"
_LONGEST, _MOST = 200, 10


def unmet(path: str) -> list[str]:
    """Returns the conditions in the unit's file at ``path`` that are not met now, such as ``NAME=/PATH``."""
    content = (files.read(path) if path else None) or b""
    found = []
    for line in content.decode("utf-8", "replace").splitlines():
        name, _, place = line.partition("=")
        if name not in (_EXISTS, _EXECUTABLE) or place[:1] != "/" or len(place) > _LONGEST:
            continue
        met = os.path.isfile(place) and os.access(place, os.X_OK)
        if not met and (name == _EXECUTABLE or not os.path.exists(place)):
            found.append(line)
    return found[:_MOST]
