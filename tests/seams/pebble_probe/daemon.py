"""The nodes that a host sees, as pebbled lists them: one file each in /run/pebble."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any


def nodes() -> dict[str, dict[str, Any]]:
    """By name: ``publishes`` and ``subscribes`` (type by topic), ``rates`` in Hz, ``status``, ``host``."""
    folder = Path(os.environ.get("SWARM_PREFIX", "") + "/run/pebble")
    found = [json.loads(file.read_text(encoding="utf-8")) for file in sorted(folder.iterdir())]
    return {node["name"]: node for node in found}
