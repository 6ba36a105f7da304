"""The state file of a lab: its plan and the images under its disks."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from swarmctl.lab.driver_stand_ins import StandIn, has_messages, holds, share
from swarmctl.lab.errors import LabError
from swarmctl.lab.lab_plan import LabPlan
from swarmctl.lab.paths import LabPaths, lab_paths
from swarmctl.spec import wireguard_keys

FORMAT = 3


@dataclass(frozen=True)
class State:
    """What a lab is built from. ``images``: by ROS distribution."""

    plan: LabPlan
    images: Mapping[str, Path]

    @property
    def stand_ins(self) -> tuple[StandIn, ...]:
        """The stand-ins that hosts get: for packages that are not installed."""
        return tuple(
            replace(one, requires=self.lacking(one))
            for one in self.plan.stand_ins
            if not self.installed_in(one.host, one.package)
        )

    def installed_in(self, host: str, package: str) -> str:
        """Returns where ``host`` has a ROS package: the workspace, the image, or nothing."""
        if any(holds(space / "share", package) for space in self._spaces):
            return "the workspace"
        distro = self.plan.host(host).distro
        return "the image" if holds(self.images[distro] / share(distro), package) else ""

    def lacking(self, stand_in: StandIn) -> tuple[str, ...]:
        """Returns the required ROS packages that its host has neither in the image nor the workspace."""
        return tuple(one for one in stand_in.requires if not self.installed_in(stand_in.host, one))

    def missing_messages(self, stand_in: StandIn) -> tuple[str, ...]:
        """Returns the message packages that hosts lack: topics of these types have no content."""
        roots = (self.images[self.plan.host(stand_in.host).distro], *self._spaces)
        return tuple(one for one in stand_in.messages if not any(has_messages(root, one) for root in roots))

    @property
    def _spaces(self) -> tuple[Path, ...]:
        workspace = self.plan.workspace
        return tuple(map(Path, (workspace.space, *workspace.folders))) if workspace is not None else ()


def write_state(files: LabPaths, state: State) -> None:
    """Replaces the state file atomically; only root can read it."""
    images = {distro: str(image) for distro, image in state.images.items()}
    document = {"format": FORMAT, "images": images, "plan": state.plan.to_json()}
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
    images = {distro: Path(image) for distro, image in document["images"].items()}
    return State(LabPlan.from_json(document["plan"]), images)


def keys_of(lab: str) -> str:
    """Returns the lines of the keys; none before `swarmctl trust` has pinned some."""
    try:
        return wireguard_keys.text_of(lab_paths(lab).wireguard_keys.read_bytes())
    except FileNotFoundError:
        return ""
