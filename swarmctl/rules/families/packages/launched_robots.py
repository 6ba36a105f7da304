"""Launch files of several robots: frames that need a prefix, and commands that pass the gate by."""

from __future__ import annotations

import re
from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, note_of_other
from swarmctl.rules.context import RuleContext, rule
from swarmctl.rules.launch_uses import LaunchUse
from swarmctl.swarm.names import driver_node, resolved

# Arguments with which launch files set apart the frames of equal robots.
_FRAMES = re.compile(r"(tf|frame|frames|frame_id|link|robot_frame)_?prefix|multi_robot_name", re.I)


@rule("PKG020", ros1=True)
def shared_frames(context: RuleContext) -> Iterator[Diagnostic]:
    """Two robots under one master start a launch file with the same value of an argument for frames."""
    first: dict[tuple[str, str, str, str, str], LaunchUse] = {}
    reported: set[tuple[str, str, str]] = set()
    for use in context.launches:
        island = context.home.get(use.host or "")
        for name, value in use.launched.arguments.items() if island and use.robot else ():
            if value is None or island is None or not _FRAMES.fullmatch(name):
                continue
            file = (island.name, use.started.package or "", use.started.launch or "")
            earlier = first.setdefault((*file, name, value), use)
            if earlier.robot == use.robot or file in reported:
                continue
            reported.add(file)
            span, other = context.launch_span(use, "launch"), context.launch_span(earlier, "launch")
            placeholder = "{frame}" if use.is_driver else "{namespace}"
            shared = f"`{name}: {value}`" if value else f"no `{name}`"
            yield Diagnostic(
                "PKG020",
                f"{earlier.owner} and {use.owner} start one launch file with {shared}",
                span,
                label="their frames have the same names",
                notes=note_of_other(other, span),
                help=(f'set them apart: args: {{{name}: "{placeholder}"}}',),
            )


@rule("PKG022", ros1=True)
def commands_past_the_gate(context: RuleContext) -> Iterator[Diagnostic]:
    """The launch file of a gated driver remaps its command topic itself, so the node ignores the gate."""
    seen = set()
    for use in context.launches:
        if not use.is_driver or use.name not in context.gated:
            continue
        driver, span = context.ros_drivers[use.name], context.launch_span(use, "launch")
        command = resolved(driver.command, driver_node(use.namespace), {})
        for node in use.launched.nodes:
            for old, new in node.remaps if node.certain and node.name is not None else ():
                after = resolved(new, node.name or "", {})
                if resolved(old, node.name or "", {}) != command or after == command:
                    continue
                if (span, node.place) not in seen:
                    seen.add((span, node.place))
                    yield Diagnostic(
                        "PKG022",
                        f"the launch file of {use.owner} remaps `{driver.command}` to `{new}` ({node.place})",
                        span,
                        label="its node takes commands from there, not from the gate",
                        help=(
                            "remove that <remap>: swarmctl remaps the command topic to the gate",
                            "or write `ungated: true` with a `reason`",
                        ),
                    )
