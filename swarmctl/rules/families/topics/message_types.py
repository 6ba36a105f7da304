"""The message types of declared topics exist."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic
from swarmctl.robot_types.protocols import RosserialProtocol
from swarmctl.robot_types.ros_driver import RosDriver
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.ros_packages.message_types import NoMessage, no_message
from swarmctl.rules.context import RuleContext, rule
from swarmctl.suggest import typing_errors
from swarmctl.yamltext.edits import make_fix, replace_value
from swarmctl.yamltext.source import Loc


@rule("TOPIC007", "TOPIC010", ros1=True)
def message_types(context: RuleContext) -> Iterator[Diagnostic]:
    """A message type that its package does not have, or whose package looks misspelt."""
    faults: dict[str, NoMessage | None] = {}
    for loc, kind in _declared(context):
        if kind not in faults:
            faults[kind] = no_message(kind, context.messages)
        if (fault := faults[kind]) is not None:
            yield _finding(context, loc, kind, fault)


def _declared(context: RuleContext) -> Iterator[tuple[Loc, str]]:
    for name, program in context.spec.programs.items():
        for key in ("publishes", "subscribes"):
            for index, topic in enumerate(getattr(program, key)):
                yield ("programs", name, key, index, "type"), topic.type
    for loc, declared in _of_robots(context):
        for key in ("publishes", "subscribes"):
            for index, topic in enumerate(getattr(declared, key)):
                yield (*loc, key, index, "type"), topic.type


def _of_robots(context: RuleContext) -> Iterator[tuple[Loc, RosserialProtocol | RosDriver]]:
    """The sketches and drivers of the spec's own types and robots."""
    for name, robot_type in context.spec.types.items():
        if isinstance(robot_type, RosRobotType):
            yield ("types", name, "driver"), robot_type.driver
        elif robot_type.sketch is not None:
            yield ("types", name, "protocol"), robot_type.sketch
    for name, robot in context.spec.robots.items():
        if isinstance(robot.driver, RosDriver):
            yield ("robots", name, "driver"), robot.driver


def _finding(context: RuleContext, loc: Loc, kind: str, fault: NoMessage) -> Diagnostic:
    meant = fault.meant[0] if fault.meant else None
    return Diagnostic(
        "TOPIC007" if fault.certain else "TOPIC010",
        f"there is no message type `{kind}`: {fault.why}" if fault.certain
        else f"`{kind}` looks misspelt: {fault.why}",
        context.span(*loc),
        label="unknown message type",
        help=(f"did you mean {' or '.join(f'`{one}`' for one in fault.meant[:3])}?",)
        if meant
        else ("`rosmsg package PACKAGE` lists the messages of a package",),
        fix=make_fix(
            f"write `{meant}`",
            replace_value(context.source, loc, meant),
            safe=fault.certain and typing_errors(kind, meant) <= 1,
        )
        if meant and len(fault.meant) == 1
        else None,
    )  # fmt: skip
