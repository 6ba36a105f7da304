"""Robot types as text and JSON: a table of all types, and one type in detail."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from rich.table import Table
from rich.text import Text

from swarmctl.analysis import serial_load
from swarmctl.plugins import LINK_KINDS
from swarmctl.robot_types.any_robot_type import AnyRobotType
from swarmctl.robot_types.driver_params import command_timeout_of, equipped, rates_of
from swarmctl.robot_types.line_protocol import CodedExchange
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.ros_driver import RosDriver
from swarmctl.robot_types.ros_launchable import Topic
from swarmctl.robot_types.ros_robot_type import RosLink, RosRobotType
from swarmctl.swarm.command_topics import COMMAND, COMMAND_TYPE
from swarmctl.swarm.topics import MESSAGES, DriverTopic, actuators_of, driver_topics, topic_of
from swarmctl.views.escape import printable

Rows = Iterable[tuple[str, ...]]


def ros_sections(kind: RosRobotType) -> Iterator[tuple[str, Rows]]:
    """Yields each heading with its rows."""
    for driver in kind.drivers:
        yield _heading("Driver", driver), _launched(driver)
    if kind.link is not None:
        yield "Link", _link(kind.link)
    yield "Limits", _axis_limits(kind)
    for driver in kind.drivers:
        yield _heading("Publishes", driver), _topics(driver.publishes)
        commands = [(driver.command, driver.command_type)] if kind.kinematics.kind != "none" else []
        yield _heading("Subscribes", driver), [*commands, *_topics(driver.subscribes)]
        yield _heading("When commands stop", driver), _ros_dead_man(kind, driver)
    if kind.source or kind.tried:
        yield "Origin", (("source", printable(kind.source)), ("tried", printable(kind.tried)))


def _heading(what: str, driver: RosDriver) -> str:
    return f"{what} ({', '.join(driver.distros)})" if driver.distros else what


def _link(link: RosLink) -> Iterator[tuple[str, ...]]:
    yield "kinds", ", ".join(link.kinds)
    if link.baud is not None:
        yield "baud", f"{link.baud}"
    if link.port is not None:
        yield "port", f"{link.port} of the robot"
    if link.local_ports:
        yield "local ports", f"{', '.join(map(str, link.local_ports))} of the host"
    if link.host_address is not None:
        yield "host address", f"{link.host_address} of the host"
    if link.load_mbps is not None:
        yield "load", f"{link.load_mbps:g} Mbit/s"


def _launched(driver: RosDriver) -> Iterator[tuple[str, ...]]:
    yield "package", ", ".join(driver.packages)
    yield ("launch file", driver.launch) if driver.launch else ("executable", driver.executable or "")
    for (key, *names), value in driver.texts:  # `params` and the like have names, a frame has none
        yield str(key), "".join(f"{one}: " for one in names[:1]) + printable(str(value))
    for old, new in driver.remap.items():
        yield "remap", f"{old} to {new}"


def _axis_limits(kind: RosRobotType) -> Iterator[tuple[str, ...]]:
    yield "kinematics", kind.kinematics.kind
    names = ("forward", "sideways", "up"), kind.kinematics.axes[:3]
    for name, fastest in zip(*names, strict=True):
        if fastest:
            yield name, f"{fastest:g} m/s"
    if kind.kinematics.axes[3]:
        yield "turn", f"{kind.kinematics.axes[3]:.3g} rad/s"


def _topics(topics: Iterable[Topic]) -> Iterator[tuple[str, ...]]:
    for one in topics:
        yield one.topic, one.type, *([f"{one.rate:g} Hz"] if one.rate else [])


def _ros_dead_man(kind: RosRobotType, driver: RosDriver) -> Iterator[tuple[str, ...]]:
    if kind.kinematics.kind == "none":
        yield "gate", "none: it takes no commands"
        return
    if driver.ungated:
        yield "gate", f"none: {printable(driver.reason or '')}"
    else:
        yield "gate", f"stops the robot after {command_timeout_of(kind.settings_layer):g} s"
    if driver.stops_after is not None:
        yield "driver", f"stops the robot after {driver.stops_after:g} s"
    else:
        yield "driver", "not known to stop the robot by itself"


SHIPPED = "swarmctl"
_LEFT = 2
_MOST_SENSES = 5  # sensors of a type in the list of types


@dataclass(frozen=True)
class Shown:
    """A robot type, its name, and its file, or ``SHIPPED`` for a type of swarmctl."""

    name: str
    source: str
    type: AnyRobotType


def table(types: Iterable[Shown]) -> Table:
    """All types; the column ``from`` is there if one is the user's own."""
    made = Table(box=None, show_edge=False, pad_edge=False)
    shown = tuple(types)
    longest = max((len(one.name) for one in shown), default=0)
    made.add_column("type", no_wrap=True, min_width=longest)
    own = any(one.source != SHIPPED for one in shown)
    for heading in ("robot", "protocol", "link", "sensors", *(["from"] if own else [])):
        made.add_column(heading, overflow="fold")
    for one in shown:
        links, senses = ", ".join(_links(one.type)), _some(_senses(one.type))
        source = [one.source] if own else []
        made.add_row(one.name, printable(one.type.title), _protocol(one.type), links, senses, *source)
    return made


def _some(names: Sequence[str]) -> str:
    """The first names; the others are counted."""
    more = len(names) - _MOST_SENSES
    return ", ".join(names[:_MOST_SENSES]) + (f" and {more} more" if more > 0 else "")


def listed(one: Shown) -> dict[str, Any]:
    """One line of the table as JSON data."""
    return {
        "type": one.name,
        "title": one.type.title,
        "protocol": _protocol(one.type),
        "links": list(_links(one.type)),
        "senses": _senses(one.type),
        "from": one.source,
    }


def detailed(one: Shown) -> dict[str, Any]:
    """Everything about one type as JSON data: its definition and what follows from it."""
    definition = one.type.model_dump(mode="json", exclude_none=True)
    follows = _of_protocol(one.type) if isinstance(one.type, RobotType) else {}
    return {**listed(one), **follows, "definition": definition}


def _of_protocol(kind: RobotType) -> dict[str, Any]:
    """What follows from the definition of a type that has a protocol."""
    return {
        "limits": {
            "wheel_speed": kind.kinematics.wheel_speed_max,
            "angular": _fastest_turn(kind),
            "units": [_units(kind, scale.speed_units_per_mps) for scale in kind.kinematics.scales],
        },
        "command_timeout": command_timeout_of(kind.settings),
        "topics": {
            "publishes": [
                {"topic": topic.name, "type": topic.type, "rate": topic.rate}
                for topic in driver_topics(kind, kind.settings)
            ],
            "subscribes": [{"topic": topic, "type": message} for topic, message in _subscribed(kind)],
        },
        "line": {link: load.to_json() for link, load in _loads(kind)},
    }


def page(one: Shown) -> Text:
    """Everything about one type as text."""
    text = Text.assemble((one.name, "bold"), f": {printable(one.type.title)}, from {one.source}\n")
    sections = _sections(one.type) if isinstance(one.type, RobotType) else ros_sections(one.type)
    for heading, rows in sections:
        text.append(f"\n{heading}\n", "bold green")
        text.append("".join(f"{line}\n" for line in _aligned(list(rows))))
    return text


def _sections(kind: RobotType) -> Iterator[tuple[str, Iterable[tuple[str, ...]]]]:
    yield "Line", _line(kind)
    yield "Limits", _limits(kind)
    if kind.driver_protocol is not None:
        yield "Requests", _requests(kind)
    yield "Publishes", _published(kind)
    yield "Subscribes", ((name, message) for name, message in _subscribed(kind))
    if kind.driver_protocol is not None:
        yield "Load of the serial line at these rates", _budgets(kind)
    yield "When commands stop", _dead_man(kind)


def _line(kind: RobotType) -> Iterator[tuple[str, ...]]:
    link = kind.link
    yield "link", ", ".join(link.kinds)
    others = f" ({', '.join(map(str, link.other_bauds))} are selectable)" if link.other_bauds else ""
    yield (
        "baud",
        f"{link.baud}{others}, {link.bytesize} data bits, parity {link.parity}, {link.stopbits} stop",
    )
    yield "protocol", _protocol_text(kind)
    if link.hint:
        yield "if it does not reply", printable(link.hint)


def _protocol_text(kind: RobotType) -> str:
    protocol = kind.protocol
    match protocol.kind:
        case "line":
            lines_ = f"lines of text that end with {protocol.terminator!r}"
            if protocol.separator != ",":
                lines_ += f", with {protocol.separator!r} between values"
            return f"{lines_}; replies within {protocol.reply_timeout:g} s"
        case "binary":
            return f"bytes, {protocol.byte_order}-endian; replies within {protocol.reply_timeout:g} s"
        case "python":
            own = f"encoded by the class {protocol.codec} beside it"
            return f"{own}; replies within {protocol.reply_timeout:g} s"
        case "rosserial":
            return f"rosserial, on an {protocol.board}"


def _limits(kind: RobotType) -> Iterator[tuple[str, ...]]:
    built = kind.kinematics
    yield "wheel", f"{built.wheel_speed_max:g} m/s", *_in_units(kind, built.wheel_speed_max)
    if built.wheel_speed_min:
        yield "slowest", f"{built.wheel_speed_min:g} m/s", *_in_units(kind, built.wheel_speed_min)
    yield "turn", f"{_fastest_turn(kind):.3g} rad/s", f"wheels {built.wheel_separation:g} m apart"
    for scale in built.scales:
        firmware = f"firmware below {scale.firmware_below:g}" if scale.firmware_below else ""
        yield "a count", f"{scale.metres_per_count:g} m", f"counters of {built.counter_bits} bits", firmware


def _in_units(kind: RobotType, speed: float) -> Iterator[str]:
    units = (round(speed * scale.speed_units_per_mps) for scale in kind.kinematics.scales)
    counts = " or ".join(map(str, units))
    if counts:
        yield f"{counts} in robot units"


def _units(kind: RobotType, per_mps: float) -> int:
    return round(kind.kinematics.wheel_speed_max * per_mps)


def _fastest_turn(kind: RobotType) -> float:
    return 2 * kind.kinematics.wheel_speed_max / kind.kinematics.wheel_separation


def _requests(kind: RobotType) -> Iterator[tuple[str, ...]]:
    protocol = kind.driver_protocol
    assert protocol is not None
    if protocol.kind == "python":
        yield "set speed", *_sizes(protocol.set_speed)
        for name, coded in protocol.queries.items():
            yield name, *_sizes(coded), _numbers(coded.values)
    else:
        yield "set speed", printable(protocol.set_speed.send), f"-> {protocol.set_speed.reply or 'no reply'}"
        if protocol.identify is not None:
            yield "identify", printable(protocol.identify.send), f"-> {protocol.identify.reply},firmware"
        for name, query in protocol.queries.items():
            numbers = f" with {_numbers(query.values)}" if protocol.kind == "line" else ""
            yield name, printable(query.send), f"-> {query.reply}{numbers}"
    for name, one in kind.actuators.items():
        span = f"0 to {one.max} for {', '.join(one.channels)}"
        reply = "" if one.send is None else f"-> {one.reply or 'no reply'}"
        yield name, printable(one.send or "its class"), reply, span


def _numbers(count: int) -> str:
    return "1 number" if count == 1 else f"{count} numbers"


def _sizes(exchange: CodedExchange) -> tuple[str, str]:
    return f"{exchange.request} bytes", f"-> {exchange.reply} bytes" if exchange.reply else "no reply"


def _published(kind: RobotType) -> Iterator[tuple[str, ...]]:
    topics = driver_topics(kind, kind.settings)
    for (name, message, rate), alike in groupby(topics, lambda one: (_family(one), one.type, one.rate)):
        elements = [one.name.rpartition("/")[2] for one in alike]
        if name.endswith("/") and len(elements) > 1:
            yield f"{name}*", message, f"{rate:g} Hz", f"for each of {', '.join(elements)}"
        else:
            yield f"{name}{elements[0]}" if name.endswith("/") else name, message, f"{rate:g} Hz"
    off = [name for name, rate in rates_of(kind, kind.settings).items() if rate == 0]
    for name in off:
        sensor = kind.sensors[name].kind
        yield topic_of(name, sensor), MESSAGES[sensor], "off; enabled by `rates`"


def _family(topic: DriverTopic) -> str:
    """The topic name; for a topic of one element, the sensor's name and a slash."""
    return "".join(topic.name.rpartition("/")[:2]) if topic.part and "/" in topic.name else topic.name


def _subscribed(kind: RobotType) -> Iterator[tuple[str, str]]:
    if kind.sketch is not None:
        yield from ((one.topic, one.type) for one in kind.sketch.subscribes)
        return
    yield COMMAND, kind.settings.command_type or COMMAND_TYPE
    yield from actuators_of(kind).items()


def _loads(kind: RobotType) -> Iterator[tuple[str, serial_load.SerialLoad]]:
    if kind.driver_protocol is not None:
        whole, rates = equipped(kind, kind.settings), rates_of(kind, kind.settings)
        for link in kind.link.kinds:
            line = next(iter(LINK_KINDS.get(link).delays))  # an unknown adapter counts as a slow one
            yield (
                link,
                serial_load.load_of(whole, line, kind.link.baud, serial_load.COMMAND_RATE, rates),
            )


def _budgets(kind: RobotType) -> Iterator[tuple[str, ...]]:
    for name, load in _loads(kind):
        bytes_ = f"{load.needed:.0f} of {load.available:.0f} B/s"
        yield name, f"{load.share:.0%}", bytes_, f"one cycle of all requests takes {load.cycle * 1000:.0f} ms"


def _dead_man(kind: RobotType) -> Iterator[tuple[str, ...]]:
    yield "driver", f"stops the robot after {command_timeout_of(kind.settings):g} s"
    if kind.sketch is not None:
        yield "sketch", f"stops the robot after {kind.sketch.firmware_timeout:g} s"
    itself = "stops on its own" if kind.firmware_dead_man else "keeps its last speed"
    yield "no driver", f"the robot {itself}"


def _protocol(kind: AnyRobotType) -> str:
    if isinstance(kind, RobotType):
        return kind.protocol.kind
    packages = ", ".join(dict.fromkeys(one.package for one in kind.drivers))
    distros = ", ".join(name for one in kind.drivers for name in one.distros)
    return f"ROS package {packages}" + (f" ({distros})" if distros else "")


def _links(kind: AnyRobotType) -> tuple[str, ...]:
    return kind.link.kinds if kind.link is not None else ()


def _senses(kind: AnyRobotType) -> list[str]:
    if not isinstance(kind, RobotType):
        return list(dict.fromkeys(topic.topic for one in kind.drivers for topic in one.publishes))
    return [one.topic for one in kind.sketch.publishes] if kind.sketch else list(kind.sensors)


def _aligned(rows: list[tuple[str, ...]]) -> Iterator[str]:
    columns: Mapping[int, int] = {
        place: max((len(row[place]) for row in rows if place < len(row)), default=0)
        for place in range(max((len(row) for row in rows), default=0))
    }
    for row in rows:
        cells = (f"{cell:<{columns[place]}}" for place, cell in enumerate(row))
        yield (" " * _LEFT + "  ".join(cells)).rstrip()
