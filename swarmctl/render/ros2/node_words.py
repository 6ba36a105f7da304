"""What follows the name of an executable: its words, and the arguments of ROS 2 behind them. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from swarmctl.render.yaml_params import rcl_params_file
from swarmctl.ros_packages.parameters import for_rcl
from swarmctl.swarm import names


def ros_args(
    node: str = "", remap: Mapping[str, str] | None = None, params: Sequence[str] = ()
) -> tuple[str, ...]:
    """Returns `--ros-args` with names to change and parameter files; ``node``: its full name."""
    words = tuple(_words(node, remap or {}, params))
    return ("--ros-args", *words) if words else ()


def _words(node: str, remap: Mapping[str, str], params: Sequence[str]) -> Iterator[str]:
    namespace, _, name = node.rpartition("/")
    if namespace:
        yield from ("-r", f"__ns:={namespace}")
    if name:
        yield from ("-r", f"__node:={name}")
    for path in params:
        yield from ("--params-file", path)
    for old, new in remapping(remap).items():
        yield from ("-r", f"{old}:={new}")


def remapping(remap: Mapping[str, str]) -> dict[str, str]:
    """Returns names to change as ROS 2 writes them: ``~/name`` for the private ``~name``."""
    return {names.ros2_name(old): names.ros2_name(new) for old, new in remap.items()}


def node_params(params: Mapping[str, Any], node: str = "/**") -> bytes:
    """Returns a parameter file for a node, of any name by default."""
    return rcl_params_file({node: {"ros__parameters": for_rcl(params)}})
