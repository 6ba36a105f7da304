"""A folder as `swarmctl run` leaves it before its index is written, and what the index has to have."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from swarmctl.capsule.capsule_index import INDEX

FILES = {
    "spec/swarm.yaml": b"version: 1\n",
    "spec/night.yaml": b"robots: {}\n",
    "bags/k3-pi_0.bag": bytes(range(256)) * 9000,  # more than one piece
    "status-before.json": b"{}",
}
ABOUT: dict[str, Any] = {
    "swarm": "lab",
    "experiment": "circle",
    "trial": 3,
    "began": 1_780_000_000.25,
    "ended": 1_780_000_060.75,
    "seconds": 60,
    "outcome": "completed",
    "cause": "",
    "operator": "ada@desk",
    "swarmctl": "0.1.0",
    "spec": ("spec/swarm.yaml", "spec/night.yaml"),
    "git": {"commit": "5" * 40, "changed": False},
    "skew": 0.0042,
    "hosts": {
        "k3-pi": {
            "address": "10.0.0.2",
            "release": "daf63a8622f33495",
            "began": 1_780_000_000.5,
            "clock": {"ahead": -0.002, "error": 0.004},
        }
    },
    "robots": {
        "k3": {"host": "k3-pi", "type": "khepera3", "state": "standing", "proof": "wheels", "seconds": 0.4}
    },
}


def filled(folder: Path) -> Path:
    for name, content in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


def edit(folder: Path, change: Callable[[dict[str, Any]], object]) -> None:
    """Change the written index."""
    index = json.loads((folder / INDEX).read_text("utf-8"))
    change(index)
    (folder / INDEX).write_text(json.dumps(index), "utf-8")
