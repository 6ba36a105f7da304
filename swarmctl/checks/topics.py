"""Topics as the spec declares them: one type for one name, somebody who publishes, nothing intertwined."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Note, Severity
from swarmctl.spec.edits import mend, replace_value
from swarmctl.spec.source import Loc
from swarmctl.spec.suggest import nearest
from swarmctl.spec.tuning import rates_of
from swarmctl.topology.interfaces import COMMAND, COMMAND_TYPE, COMMON, Endpoint, sensor_behind, sensors_of
from swarmctl.topology.names import parted

_FEW = 50  # where more is wrong, or more could be meant, no suggestion is worth its time
_SAME = {"tf/tfMessage": "tf2_msgs/TFMessage"}  # one message under two names, with one checksum


def clashing_types(case: Case) -> Iterator[Diagnostic]:
    """TOPIC001: one topic with two types; ROS connects neither side and says nothing."""
    first: dict[tuple[str, str], Endpoint] = {}
    reached = _crossed(case)
    for one in sorted(case.endpoints, key=lambda one: not one.publishes):
        given = _SAME.get(one.type, one.type)
        if one.topic in COMMON and COMMON[one.topic] != given:
            yield _clash(case, one, COMMON[one.topic], "ROS itself", None)
        elif (driven := _of_a_driver(case, one.topic)) is not None and driven[1] != given:
            robot, kind = driven
            yield _clash(case, one, kind, f"the driver of `{robot}`", ("robots", robot))
        elif one.topic not in COMMON and driven is None:
            home = case.home.get(one.host)
            islands = {home.name} if home else set()
            for island in islands | (reached.get(one.topic, set()) if islands else set()):
                earlier = first.setdefault((island, one.topic), one)
                if earlier.type != one.type:
                    yield _clash(case, one, earlier.type, f"program `{earlier.owner}`", earlier.loc)
                    break


def _crossed(case: Case) -> Mapping[str, set[str]]:
    """By topic, the islands between which it crosses."""
    found: dict[str, set[str]] = {}
    for bridge in case.bridges if case.endpoints else ():
        found.setdefault(bridge.topic, set()).update((bridge.origin, *bridge.to))
    return found


def _of_a_driver(case: Case, topic: str) -> tuple[str, str] | None:
    """The robot whose driver has ``topic``, and its message type."""
    space, name = parted(topic)
    if name == COMMAND:
        robot = case.publishers.robots.get(space)
        return (robot, COMMAND_TYPE) if robot is not None else None
    return case.publishers.sensed(topic)


def _clash(case: Case, one: Endpoint, other: str, who: str, where: Loc | None) -> Diagnostic:
    loc = (*one.loc, "type")
    is_program = where is not None and where[0] == "programs"
    notes = () if where is None else (
        Note(case.span(*where, "type"), "the other type")
        if is_program
        else Note(case.span(*where, key=True), f"its driver has {other}"),
    )  # fmt: skip
    return Diagnostic(
        "TOPIC001",
        f"`{one.topic}` is {one.type} to program `{one.owner}`, and {other} to {who}",
        case.span(*loc),
        label="another type",
        notes=notes,
        help=("write the type that the node really uses; `rostopic type` shows it on a running one",),
        fix=None if is_program else mend(f"write `{other}`", replace_value(case.source, loc, other)),
    )


def dangling_subscribers(case: Case) -> Iterator[Diagnostic]:
    """TOPIC002: programs hear topics that nobody publishes; one finding a program.

    Programs that do not say what they publish may publish anything, and a board's sketch may wait for whoever
    comes; then only what looks misspelt is told.
    """
    lost = [
        one
        for one in case.endpoints
        if not one.publishes and not _may_be_published(one) and not case.publishers.of(one.topic)
    ]
    programs = case.spec.programs.items()
    silent = {name for name, one in programs if not one.publishes and one.use is None}
    dangling: dict[str, list[tuple[Endpoint, str | None]]] = {}
    for one in lost:
        near = _nearest(case, one.topic) if len(lost) <= _FEW else None
        if near is not None or (silent <= {one.owner} and case.spec.programs[one.owner].board is None):
            dangling.setdefault(one.owner, []).append((one, near))
    for owner, found in dangling.items():
        one, near = next((pair for pair in found if pair[1] is not None), found[0])
        more = f" and {len(found) - 1} more" if len(found) > 1 else ""
        loc = (*one.loc, "topic")
        yield Diagnostic(
            "TOPIC002",
            f"program `{owner}` hears `{one.topic}`{more}, which nobody publishes",
            case.span(*loc),
            severity=Severity.WARNING,
            label="waits for ever and says nothing",
            help=(f"did you mean `{near}`?",)
            if near
            else ("correct the name, or declare it under `publishes` of the program that it comes from",),
            fix=mend(f"write `{near}`", replace_value(case.source, loc, near)) if near else None,
        )


def _may_be_published(one: Endpoint) -> bool:
    """By ROS itself, or by people: they send orders by hand, and ask a node by its private topics."""
    topic = one.topic
    return topic in COMMON or topic.rpartition("/")[2] == COMMAND or topic.startswith(f"{one.node}/")


def _nearest(case: Case, topic: str) -> str | None:
    """The published topic that ``topic`` may be misspelt for."""
    space, name = parted(topic)
    robots = case.publishers.robots
    known = list(case.publishers.programs)
    if space in robots:
        said = case.spec.robots[robots[space]]
        known += [f"{space}/{one}" for one in sensors_of(case.types[said.type], said.driver)]
    elif len(robots) <= _FEW:
        known += [topic for one in robots if case.publishers.sensed(topic := f"{one}/{name}")]
    return nearest(topic, tuple(known))


def sensors_off(case: Case) -> Iterator[Diagnostic]:
    """TOPIC003: a program hears a sensor that is turned off."""
    for one in case.endpoints:
        driven = None if one.publishes else _of_a_driver(case, one.topic)
        sensor = sensor_behind(parted(one.topic)[1])
        if driven is None or sensor == COMMAND or one.topic in case.publishers.programs:
            continue
        robot = case.spec.robots[driven[0]]
        kind = case.types[robot.type]
        if kind.sketch is not None:  # a sketch publishes what its type says
            continue
        if rates_of(kind, case.spec.defaults.robot, kind.settings, robot.settings)[sensor] > 0:
            continue
        off = robot.settings.rates.get(sensor) == 0
        yield Diagnostic(
            "TOPIC003",
            f"program `{one.owner}` hears `{one.topic}`, which robot `{driven[0]}` does not publish",
            case.span(*one.loc, "topic"),
            severity=Severity.WARNING,
            label="turned off",
            notes=(Note(case.span("robots", driven[0], "settings", "rates", sensor), "0 turns it off"),)
            if off
            else (Note(case.span("robots", driven[0], key=True), "this robot"),),
            help=(f"give it a rate: settings: {{rates: {{{sensor}: 10.0}}}}",),
        )


def intertwined_topics(case: Case) -> Iterator[Diagnostic]:
    """TOPIC004: programs of several robots publish one topic; who hears it hears a mixture."""
    first: dict[tuple[str, str], Endpoint] = {}
    robots = {name: program.robot for name, program in case.spec.programs.items()}
    reached = _crossed(case)
    for one in case.endpoints:
        robot, home = robots[one.owner], case.home.get(one.host)
        if not one.publishes or robot is None or home is None or one.topic in COMMON:
            continue
        for island in {home.name} | reached.get(one.topic, set()):
            earlier = first.setdefault((island, one.topic), one)
            if robots[earlier.owner] != robot:
                yield Diagnostic(
                    "TOPIC004",
                    f"programs of robots `{robots[earlier.owner]}` and `{robot}` both publish `{one.topic}`",
                    case.span(*one.loc, "topic"),
                    severity=Severity.WARNING,
                    label="mixed with the other robot's",
                    notes=(Note(case.span(*earlier.loc, "topic"), f"the one of `{robots[earlier.owner]}`"),),
                    help=("write it without the first `/`: each robot then has its own, in its namespace",),
                )
                break


def orders_to_nobody(case: Case) -> Iterator[Diagnostic]:
    """TOPIC005: orders on a topic that is no robot's, and that no program is said to hear."""
    heard = {one.topic for one in case.endpoints if not one.publishes}
    for one in case.endpoints:
        space, _, name = one.topic.rpartition("/")
        robots = case.publishers.robots
        if not one.publishes or name != COMMAND or space in robots or one.topic in heard:
            continue
        near = nearest(space.strip("/"), tuple(other.strip("/") for other in robots)) if space else None
        meant = f"/{near}/{COMMAND}" if near else f"{next(iter(robots))}/{COMMAND}"
        written = case.spec.programs[one.owner]
        loc = (*one.loc, "topic")
        as_is = not written.remap and one.topic == _written(one, case)
        yield Diagnostic(
            "TOPIC005",
            f"program `{one.owner}` sends orders to `{one.topic}`, which no robot hears",
            case.span(*loc),
            severity=Severity.WARNING,
            label="each robot has its own topic of orders",
            help=(f"did you mean `{meant}`?",) if near else (f"remap it: remap: {{{COMMAND}: {meant}}}",),
            fix=mend(f"write `{meant}`", replace_value(case.source, loc, meant)) if near and as_is else None,
        )


def _written(one: Endpoint, case: Case) -> str:
    """The name of an endpoint as it stands in the spec."""
    topics = getattr(case.spec.programs[one.owner], "publishes" if one.publishes else "subscribes")
    return str(topics[one.loc[-1]].topic)


def echoes(case: Case) -> Iterator[Diagnostic]:
    """TOPIC006: a program hears what it publishes itself."""
    said = {(one.owner, one.topic): one for one in case.endpoints if one.publishes}
    for one in case.endpoints:
        other = None if one.publishes else said.get((one.owner, one.topic))
        if other is not None and one.topic not in COMMON:
            yield Diagnostic(
                "TOPIC006",
                f"program `{one.owner}` hears `{one.topic}`, which it publishes itself",
                case.span(*one.loc, "topic"),
                severity=Severity.WARNING,
                label="its own messages come back",
                notes=(Note(case.span(*other.loc, "topic"), "published here"),),
                help=("let one of the two have another name, here or by `remap`",),
            )


RULES: tuple[Rule, ...] = (
    clashing_types,
    dangling_subscribers,
    sensors_off,
    intertwined_topics,
    orders_to_nobody,
    echoes,
)
