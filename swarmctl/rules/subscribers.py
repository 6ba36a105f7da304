"""Programs that subscribe to a topic without a publisher, and topics that have one source."""

from __future__ import annotations

import re
from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.linter.context import RuleContext, rule
from swarmctl.robot_types.driver_params import rates_of
from swarmctl.rules.topics import bridged
from swarmctl.spec.program_model import Program
from swarmctl.suggest import MOST_NEAR, Guess, guess, suggestion
from swarmctl.swarm.command_topics import COMMAND
from swarmctl.swarm.topics import JOINTS, JOY_TYPE, Endpoint, sensor_behind
from swarmctl.yamltext.edits import make_fix, replace_value

_GAMEPAD = (
    "read the gamepad without another node: params: {device: /dev/input/js0}",
    "add the program {package: joy, executable: joy_node, params: {autorepeat_rate: 20.0}}",
)
_DECLARE = ("correct the name, or declare it under `publishes` of its program",)
_PAD_WORDS = re.compile("joy|pad|stick|wii|ps[345]|xbox|spacenav|mouse")
_FEW = 50  # no suggestions for more findings or more candidates than this


@rule("TOPIC002")
def dangling_subscribers(context: RuleContext) -> Iterator[Diagnostic]:
    """A program subscribes to a topic without a publisher; one finding per program.

    Programs without declared topics may publish anything, and a board may wait for an external publisher;
    then only topics that look misspelt are reported.
    """
    lost = [
        one
        for one in context.endpoints
        if not one.publishes
        and one.host
        and not _may_be_published(context, one)
        and not context.publishers.of(one.topic)
    ]
    publishing = {one.owner for one in context.endpoints if one.publishes}
    programs = context.spec.programs
    silent = {name for name, one in programs.items() if name not in publishing and one.use is None}
    gamepads = {name for name in silent if _may_read_a_gamepad(programs[name])}
    dangling: dict[str, list[tuple[Endpoint, Guess]]] = {}
    for one in lost:
        meant = _likely(context, one) if len(lost) <= _FEW else Guess()
        unknown = gamepads if one.type == JOY_TYPE else silent
        if meant.words or (unknown <= {one.owner} and programs[one.owner].board is None):
            dangling.setdefault(one.owner, []).append((one, meant))
    for owner, found in dangling.items():
        one, meant = next((pair for pair in found if pair[1].words), found[0])
        near = meant.only
        more = f" and {len(found) - 1} more" if len(found) > 1 else ""
        loc, swapped = _written(context, one)
        declared = isinstance(one.loc[-1], int)
        yield Diagnostic(
            "TOPIC002",
            f"program `{owner}` subscribes to `{one.topic}`{more}, without a publisher",
            context.span(*loc),
            label="waits forever without an error",
            help=(
                *((f"`remap` has the node's own name first: {{{swapped}}}",) if swapped else ()),
                *(suggestion(meant, (), "") if declared else ()),
                *(
                    (f"read `{near}`, which is published: {_reading(programs[owner], near)}",)
                    if near and not declared
                    else ()
                ),
                *(() if declared else _gamepad_help(context, programs[owner])),
                *(_DECLARE if declared else ()),
            ),
            fix=make_fix(f"write `{near}`", replace_value(context.source, loc, near), safe=False)
            if near and declared
            else None,
        )


def _written(context: RuleContext, one: Endpoint) -> tuple[tuple[str | int, ...], str]:
    """Returns the place of a topic's name, and the entry meant by a `remap` that is the wrong way round."""
    place = (*one.loc, "topic")
    if not isinstance(one.loc[-1], int):
        return place, ""
    program = context.spec.programs[one.owner]
    name = program.subscribes[one.loc[-1]].topic
    if name in program.remap:
        return ("programs", one.owner, "remap", name), ""
    given = next((old for old, new in program.remap.items() if new == name), "")
    swapped = f"{name}: {given}" if context.publishers.of(given) else ""
    return place, swapped


def _reading(program: Program, topic: str) -> str:
    """Returns how a program of gamepads is set to read ``topic``."""
    return f"params: {{topic: {topic}}}" if program.use else f"remap: {{joy: {topic}}}"


def _gamepad_help(context: RuleContext, program: Program) -> tuple[str, ...]:
    """Returns how a program gets a gamepad's state: from a joy_node that is there, or from one to add."""
    first = _GAMEPAD[:1] if program.use else ()
    there = next((name for name, one in context.spec.programs.items() if one.executable == "joy_node"), None)
    if there is None:
        return (*first, *_GAMEPAD[1:])
    topics = [one.topic for one in context.endpoints if one.publishes and one.owner == there]
    if len(topics) == 1:
        return (*first, f"or read what `{there}` publishes: {_reading(program, topics[0])}")
    return (*first, f"or check what `{there}` publishes")


def _may_read_a_gamepad(program: Program) -> bool:
    """True if a program that declares nothing may publish a gamepad's state."""
    return program.launch is not None or bool(
        _PAD_WORDS.search(f"{program.package} {program.executable}".lower())
    )


def _may_be_published(context: RuleContext, one: Endpoint) -> bool:
    """True if ROS itself or a person may publish it: common, command and private topics."""
    topic = one.topic
    return (
        topic in context.common_topics
        or topic.rpartition("/")[2] == COMMAND
        or topic in context.robots_by_command
        or topic.startswith(f"{one.node}/")
    )


def _likely(context: RuleContext, one: Endpoint) -> Guess:
    """Returns the published topics that may be meant; a program's own robot comes before others."""
    space, name = context.split_topic(one.topic)
    word = one.topic.rpartition("/")[2]
    elsewhere = tuple(
        other
        for other, types in context.publishers.programs.items()
        if other.rpartition("/")[2] == word and one.type in types.values()
    )
    if len(elsewhere) == 1:
        return Guess(elsewhere)
    robots = context.robot_by_namespace
    known = list(context.publishers.programs)
    if space in robots:
        sensed = context.sensors_of(robots[space])
        below = [topic for topic, kind in sensed.items() if topic.startswith(f"{name}/") and kind == one.type]
        if len(below) == 1:
            return Guess((f"{space}/{below[0]}",))
        return guess(one.topic, [*known, *(f"{space}/{topic}" for topic in sensed)])
    spaces = robots if len(robots) <= _FEW else ()
    same = tuple(topic for at in spaces if context.publishers.sensed(topic := f"{at}/{name}"))
    meant, own = guess(one.topic, (*known, *same)), _of_own_robot(context, one, name)
    if own is None or meant.only == own:
        without_robot = not space and not meant.words and len(same) <= MOST_NEAR
        return Guess(same) if without_robot else meant
    return Guess((*meant.words, own)[:2]) if space else Guess((own,))


def _of_own_robot(context: RuleContext, one: Endpoint, name: str) -> str | None:
    """Returns the topic of that name of the robot that the program belongs to."""
    robot = context.spec.programs[one.owner].robot
    topic = f"{context.namespaces[robot]}/{name}" if robot is not None else ""
    return topic if context.publishers.sensed(topic) else None


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
