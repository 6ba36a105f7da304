"""Topics that have one source by their meaning: a sensor, an odometry, a map."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.robot_types.effective_settings import rates_of
from swarmctl.rules.context import RuleContext, rule
from swarmctl.rules.families.topics.rules import bridged
from swarmctl.swarm.topics import JOINTS, Endpoint, sensor_behind

# Whoever receives these takes each message for the next state of one thing.
_OF_ONE_THING = frozenset(
    {
        "nav_msgs/Odometry",
        "nav_msgs/OccupancyGrid",
        "sensor_msgs/LaserScan",
        "sensor_msgs/Imu",
        "sensor_msgs/Image",
        "sensor_msgs/CompressedImage",
        "sensor_msgs/CameraInfo",
        "sensor_msgs/Joy",
        "sensor_msgs/NavSatFix",
        "sensor_msgs/MagneticField",
        "sensor_msgs/BatteryState",
    }
)


@rule("TOPIC008")
def doubled_sensors(context: RuleContext) -> Iterator[Diagnostic]:
    """A program publishes what the driver of a robot publishes."""
    for one in context.endpoints:
        driven = context.publishers.sensed(one.topic) if one.publishes else None
        name = context.split_topic(one.topic)[1]
        if driven is None or name == JOINTS or not _is_published(context, driven[0], sensor_behind(name)):
            continue
        robot, home = driven[0], context.home.get(one.host)
        if home is None or context.publishers.island(robot) not in _islands(context, one, home.name):
            continue
        sensor = sensor_behind(name)
        polled = robot in context.driven_robots and context.driven_robots[robot].sketch is None
        off = f"settings: {{rates: {{{sensor}: 0}}}}"
        yield Diagnostic(
            "TOPIC008",
            f"program `{one.owner}` publishes `{one.topic}`, as the driver of robot `{robot}` does",
            context.span(*one.loc, "topic"),
            label="two sources",
            notes=(Note(context.span("robots", robot, key=True), "its driver publishes it too"),),
            help=(
                f"publish it under another name, such as `{one.topic}_filtered`",
                *((f"or turn the robot's own off: {off}",) if polled else ()),
            ),
        )


def _is_published(context: RuleContext, robot: str, sensor: str) -> bool:
    """True if the robot's driver publishes a sensor, by its rate."""
    kind = context.driven_robots.get(robot)
    if kind is None or kind.sketch is not None:  # its topics are declared
        return True
    return rates_of(kind, *context.document.settings_layers(robot)).get(sensor, 0) > 0


def _islands(context: RuleContext, one: Endpoint, home: str) -> set[str]:
    """The islands on which messages of an endpoint are seen."""
    return {home} | bridged(context).get(one.topic, set())


@rule("TOPIC009")
def doubled_publishers(context: RuleContext) -> Iterator[Diagnostic]:
    """Two programs publish what has one source. TOPIC004 is about programs of two robots."""
    first: dict[tuple[str, str], Endpoint] = {}
    programs = context.spec.programs
    for one in context.endpoints:
        home = context.home.get(one.host)
        if not one.publishes or one.type not in _OF_ONE_THING or home is None:
            continue
        if context.publishers.sensed(one.topic) is not None:
            continue
        for island in _islands(context, one, home.name):
            earlier = first.setdefault((island, one.topic), one)
            mine, other = programs[one.owner], programs[earlier.owner]
            of_two_robots = None not in (mine.robot, other.robot) and mine.robot != other.robot
            if earlier.owner == one.owner or of_two_robots or (mine.optional and other.optional):
                continue
            yield Diagnostic(
                "TOPIC009",
                f"programs `{earlier.owner}` and `{one.owner}` both publish `{one.topic}`",
                context.span(*one.loc, "topic"),
                label=f"a second source of one {one.type}",
                notes=(Note(context.span(*earlier.loc, "topic"), f"published by `{earlier.owner}`"),),
                help=(f"give each its own topic: remap: {{{one.topic}: {one.topic}_2}}",),
            )
            break
