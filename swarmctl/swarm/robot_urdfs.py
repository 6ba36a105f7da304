"""The URDFs beside a spec: which robot has which, and what each describes. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from swarmctl.ros_packages.urdf import Urdf, UrdfError, read_urdf
from swarmctl.spec.load import Document


@dataclass(frozen=True)
class RobotUrdfs:
    """``paths`` by robot, from the spec's folder; ``read`` by path, where the file could be read."""

    paths: Mapping[str, str] = field(default_factory=dict)
    read: Mapping[str, Urdf | UrdfError] = field(default_factory=dict)

    def of(self, robot: str) -> Urdf | None:
        """Returns the URDF of a robot; None if it has none, or one that is wrong."""
        found = self.read.get(self.paths.get(robot, ""))
        return found if isinstance(found, Urdf) else None


def urdfs_of(document: Document) -> RobotUrdfs:
    """Returns the URDFs of the robots of a document, each robot's own before that of its type."""
    of_types = {name: one.urdf for name, one in document.own_types.items() if one.urdf is not None}
    named = ((name, one.urdf or of_types.get(one.type)) for name, one in document.spec.robots.items())
    paths = {name: path for name, path in named if path is not None}
    content = document.files.content
    known = (path for path in dict.fromkeys((*paths.values(), *of_types.values())) if path in content)
    return RobotUrdfs(paths, {path: _read(content[path]) for path in known})


def _read(content: bytes) -> Urdf | UrdfError:
    try:
        return read_urdf(content)
    except UrdfError as error:
        return error
