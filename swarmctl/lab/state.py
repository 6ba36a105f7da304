"""What a lab writes down about itself: its plan and the image that its disks lie over."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from swarmctl.lab.errors import LabError
from swarmctl.lab.places import Home
from swarmctl.lab.plan import LabPlan

FORMAT = 2


@dataclass(frozen=True)
class State:
    plan: LabPlan
    image: Path


def write_state(home: Home, state: State) -> None:
    document = {"format": FORMAT, "image": str(state.image), "plan": state.plan.to_json()}
    fresh = home.state.with_suffix(".new")
    fresh.write_text(json.dumps(document, indent=1) + "\n")
    fresh.chmod(0o600)
    fresh.replace(home.state)


def read_state(home: Home) -> State:
    """The state of a lab that is or was up. Raises ``LabError`` when there is none."""
    try:
        document = json.loads(home.state.read_text())
    except FileNotFoundError:
        raise LabError(f"lab {home.name} is not up", "run `swarmctl lab up` first") from None
    except PermissionError:
        raise LabError(f"lab {home.name} belongs to root", "run the same command with sudo") from None
    if document["format"] != FORMAT:
        raise LabError(
            f"lab {home.name} was made by another swarmctl", "run `swarmctl lab down` and `lab up` again"
        )
    return State(LabPlan.from_json(document["plan"]), Path(document["image"]))
