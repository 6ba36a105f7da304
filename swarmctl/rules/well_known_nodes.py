"""Programs whose nodes everybody knows: static transforms, relays of topics, and packages of ROS 1."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from itertools import pairwise

from swarmctl.diagnostics import Diagnostic, Note, note_of_other
from swarmctl.linter.context import RuleContext, rule
from swarmctl.robot_types.ros_launchable import PlaceholderError, filled
from swarmctl.spec.program_model import Program
from swarmctl.swarm.names import resolved
from swarmctl.yamltext.edits import make_fix, replace_value

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)


@rule("TF001", by_distro=True)
def static_transforms(context: RuleContext) -> Iterator[Diagnostic]:
    """A static transform of a frame to itself, or a second one to a frame that has a parent."""
    first: dict[tuple[str, str], tuple[str, str]] = {}
    for name, program in context.spec.programs.items():
        home = context.home.get(context.program_hosts[name] or "")
        frames = _frames(context, name, program)
        if home is None or frames is None:
            continue
        parent, child = frames
        span = context.span("programs", name, "args")
        if parent == child:
            yield Diagnostic(
                "TF001",
                f"program `{name}` publishes a transform from `{parent}` to itself",
                span,
                label="listeners ignore it",
                help=("name the parent and the child: two frames",),
            )
            continue
        other, known = first.setdefault((home.name, child), (name, parent))
        if known != parent:
            place = context.span("programs", other, "args")
            yield Diagnostic(
                "TF001",
                f"the frame `{child}` has two parents, `{known}` and `{parent}`",
                span,
                label="the second parent",
                notes=(Note(place, "the first"),) if place != span else (),
                help=("leave one of the two transforms, or exchange parent and child of one",),
            )


def _frames(context: RuleContext, name: str, program: Program) -> tuple[str, str] | None:
    """The parent and the child of a static transform; None if there are none, or they are not known."""
    if program.executable != "static_transform_publisher" or not isinstance(program.args, tuple):
        return None
    space = context.program_namespaces[name][1:]
    host = context.program_hosts[name] or ""
    values = {"program": name, "namespace": space, "robot": program.robot or "", "host": host}
    words = list[str]()
    with suppress(PlaceholderError):
        words = [str(filled(str(word), values)) for word in program.args]
    named = {flag: word for flag, word in pairwise(words) if flag.endswith("frame-id")}
    if named:
        frames = [named.get("--frame-id"), named.get("--child-frame-id")]
    else:
        frames = [one for one in words if not _NUMBER.fullmatch(one)]
    if len(frames) != 2 or not all(frames):
        return None
    return str(frames[0]).lstrip("/"), str(frames[1]).lstrip("/")


@rule("TOPIC012", by_distro=True)
def relays_in_a_loop(context: RuleContext) -> Iterator[Diagnostic]:
    """Relays of topic_tools that publish each other's topics."""
    relayed: dict[tuple[str, str], tuple[str, str]] = {}
    for name, program in context.spec.programs.items():
        home = context.home.get(context.program_hosts[name] or "")
        is_relay = program.package == "topic_tools" and program.executable == "relay"
        if home is None or not is_relay or not isinstance(program.args, tuple) or len(program.args) != 2:
            continue
        node = context.program_nodes[name]
        given, sent = (resolved(str(word), node, program.remap) for word in program.args)
        relayed[home.name, given] = name, sent
    for (island, start), (name, _) in relayed.items():
        topics = [start]
        while (way := relayed.get((island, topics[-1]))) is not None and way[1] not in topics:
            topics.append(way[1])
        if way is not None and way[1] == start and start == min(topics):
            span, other = context.span("programs", name, "args"), context.span("programs", way[0], "args")
            yield Diagnostic(
                "TOPIC012",
                f"relays publish `{start}` in a loop: {' to '.join([*topics, start])}",
                span,
                label="each message goes round for ever",
                notes=note_of_other(other, span),
                help=("remove one of the relays, or relay to a topic of its own",),
            )


_SUCCESSORS = {
    "amcl": "nav2_amcl", "gmapping": "slam_toolbox", "map_server": "nav2_map_server",
    "move_base": "nav2_bringup", "robot_pose_ekf": "robot_localization", "tf": "tf2_ros",
    "rosbag": "rosbag2", "nodelet": "rclcpp_components", "rosserial_python": "micro_ros_agent",
}  # fmt: skip


@rule("PKG026", by_distro=True)
def packages_of_ros_1(context: RuleContext) -> Iterator[Diagnostic]:
    """A package of ROS 1 that ROS 2 does not have."""
    for name, program in context.spec.programs.items() if not context.can("ros1-nodes") else ():
        package = program.package or ""
        if package in _SUCCESSORS and package not in context.document.packages.by_name:
            loc, instead = ("programs", name, "package"), _SUCCESSORS[package]
            edits = replace_value(context.source, loc, instead)
            yield Diagnostic(
                "PKG026",
                f"`{package}` is a package of ROS 1; `{next(iter(context.distros))}` does not have it",
                context.span(*loc),
                label="not found",
                help=(f"`{instead}` took its place in ROS 2",),
                fix=make_fix(f"write `{instead}`", edits, safe=False) if package == "tf" else None,
            )
