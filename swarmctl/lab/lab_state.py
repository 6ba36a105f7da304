"""The state file of a lab: its plan and the image under its disks."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from swarmctl.lab.errors import LabError
from swarmctl.lab.lab_plan import LabPlan
from swarmctl.lab.paths import LabPaths

FORMAT = 2


@dataclass(frozen=True)
class State:
    """What a lab is built from."""

    plan: LabPlan
    image: Path


def write_state(files: LabPaths, state: State) -> None:
    """Replaces the state file atomically; only root can read it."""
    document = {"format": FORMAT, "image": str(state.image), "plan": state.plan.to_json()}
    fresh = files.state.with_suffix(".new")
    fresh.write_text(json.dumps(document, indent=1) + "\n")
    fresh.chmod(0o600)
    fresh.replace(files.state)


def read_state(files: LabPaths) -> State:
    """Reads the state of a lab that is or was up. Raises ``LabError`` if there is none or root owns it."""
    try:
        document = json.loads(files.state.read_text())
    except FileNotFoundError:
        raise LabError(f"lab {files.name} is not up", "run `swarmctl lab up` first") from None
    except PermissionError:
        raise LabError(f"lab {files.name} belongs to root", "run the same command with sudo") from None
    if document["format"] != FORMAT:
        raise LabError(
            f"lab {files.name} was made by another version of swarmctl",
            "run `swarmctl lab down` and `lab up` again",
        )
    return State(LabPlan.from_json(document["plan"]), Path(document["image"]))
