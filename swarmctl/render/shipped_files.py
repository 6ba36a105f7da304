"""What lands on a host as it stands here: tools, and the ROS packages of shipped programs."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from swarmctl import resources
from swarmctl.render.bundle import File

#: A ROS package of `swarm_onboard/nodes` -> the packages of `swarm_onboard` that its programs need.
NEEDS = {
    "drivers": ("driver", "command", "rosserial", "ros", "common"),
    "gate": ("gate", "command", "ros", "common"),
    "guard": ("guard", "common"),
    "multimaster": ("multimaster", "common"),
    "domain_relay": ("domain_relay", "multimaster", "common", "ros"),
    "stand_in": ("stand_in", "command", "ros", "common"),
    "teleop": ("teleop", "ros", "common"),
    "tunnel": ("tunnel", "common"),
}


@cache
def text(path: str) -> bytes:
    """Returns one file, by its path below `templates/`."""
    return (resources.templates() / path).read_bytes()


@cache
def folder(name: str, ros: str = "") -> tuple[File, ...]:
    """Returns the files of one ROS package, in a folder of its name; scripts stay executable.

    ``ros``: the package of `swarm_onboard` with which its programs become nodes.
    """
    onboard = resources.onboard()
    inside = f"{name}/{onboard.name}"
    packages = (*NEEDS[name], ros) if ros else NEEDS[name]
    return (
        *below(onboard / "nodes" / name, name),
        File(f"{inside}/__init__.py", (onboard / "__init__.py").read_bytes()),
        *(file for package in packages for file in below(onboard / package, f"{inside}/{package}")),
    )


@cache
def below(root: Path, target: str) -> tuple[File, ...]:
    """Returns the files below ``root``, by their paths below ``target``."""
    return tuple(
        File(
            f"{target}/{path.relative_to(root)}",
            path.read_bytes(),
            0o755 if path.stat().st_mode & 0o100 else 0o644,
        )
        for path in sorted(root.rglob("*"))
        if path.is_file() and "__pycache__" not in path.parts and path.suffix != ".pyc"
    )
