"""The configuration of a stand-in: a JSON file for each namespace, written by the lab."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from swarm_onboard.stand_in.body import Axes


@dataclass(frozen=True)
class Output:
    """A topic that the driver would publish; ``rate`` in Hz, 0 for one message when it starts."""

    topic: str
    type: str
    rate: float


@dataclass(frozen=True)
class Config:
    """What the driver takes and gives. ``frame`` begins the names of its frames; empty if nothing does.

    ``wheel_separation`` is 0 for a robot without wheels; ``inputs`` are the topics beside ``command``, with
    their types.
    """

    robot: str
    frame: str
    odom_frame: str
    command: str
    command_type: str
    limits: Axes
    wheel_separation: float
    inputs: tuple[tuple[str, str], ...]
    outputs: tuple[Output, ...]

    def frame_of(self, name: str) -> str:
        """Returns the frame ``name`` of this robot."""
        return f"{self.frame}/{name}" if self.frame else name


def load(folder: Path, namespace: str) -> Config:
    """Reads the configuration for a node in ``namespace``. Raises ``OSError`` where there is none."""
    name = namespace.strip("/").replace("/", ".")
    data = json.loads((folder / (name + ".json")).read_text())
    x, y, z, turn = map(float, data["limits"])
    return Config(
        **{
            **data,
            "limits": (x, y, z, turn),
            "inputs": tuple((topic, kind) for topic, kind in data["inputs"]),
            "wheel_separation": float(data["wheel_separation"]),
            "outputs": tuple(Output(**one) for one in data["outputs"]),
        }
    )
