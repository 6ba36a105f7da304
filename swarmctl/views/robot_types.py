"""Robot types for people and programs: all as a table, one with everything that a driver makes of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from rich.table import Table
from rich.text import Text

from swarmctl.spec.queries import CodedExchange
from swarmctl.spec.robot_type import RobotType
from swarmctl.spec.tuning import command_timeout_of, equipped, rates_of
from swarmctl.topology import lines
from swarmctl.topology.interfaces import (
    COMMAND,
    COMMAND_TYPE,
    MESSAGES,
    DriverTopic,
    actuators_of,
    driver_topics,
)
from swarmctl.views.text import printable

SHIPPED = "swarmctl"
_KINDS = {"serial": "usb", "bluetooth": "bluetooth"}  # an adapter that nobody knows is a slow one
_LEFT = 2


@dataclass(frozen=True)
class Shown:
    """A robot type, its name, and the file it comes from; ``SHIPPED`` for those that swarmctl brings."""

    name: str
    source: str
    type: RobotType


def table(types: Iterable[Shown]) -> Table:
    """All types, one a line."""
    made = Table(box=None, show_edge=False, pad_edge=False)
    for heading in ("type", "robot", "speaks", "by", "senses", "from"):
        made.add_column(heading, no_wrap=heading != "senses")
    for one in types:
        made.add_row(
            one.name, printable(one.type.title), one.type.protocol.kind, ", ".join(one.type.link.kinds),
            ", ".join(_senses(one.type)), one.source,
        )  # fmt: skip
    return made


def listed(one: Shown) -> dict[str, Any]:
    """One line of the table for programs."""
    return {
        "type": one.name,
        "title": one.type.title,
        "protocol": one.type.protocol.kind,
        "links": list(one.type.link.kinds),
        "senses": _senses(one.type),
        "from": one.source,
    }


def detailed(one: Shown) -> dict[str, Any]:
    """Everything about one type for programs: how it is written, and what follows from that."""
    budgets = {kind: lines.LineBudget(one.name, "", load).to_json() for kind, load in _loads(one.type)}
    for budget in budgets.values():
        del budget["robot"], budget["host"]
    return {
        **listed(one),
        "limits": {
            "wheel_speed": one.type.kinematics.wheel_speed_max,
            "angular": _fastest_turn(one.type),
            "units": [_units(one.type, scale.speed_units_per_mps) for scale in one.type.kinematics.scales],
        },
        "command_timeout": command_timeout_of(one.type, one.type.settings),
        "topics": {
            "publishes": [
                {"topic": topic.name, "type": topic.type, "rate": topic.rate}
                for topic in driver_topics(one.type, one.type.settings, "swarmctl")
            ],
            "subscribes": [{"topic": name, "type": kind} for name, kind in _hears(one.type)],
        },
        "line": budgets,
        "definition": one.type.model_dump(mode="json", exclude_none=True),
    }


def page(one: Shown) -> Text:
    """Everything about one type on a screen."""
    text = Text.assemble((one.name, "bold"), f": {printable(one.type.title)}, from {one.source}\n")
    for heading, rows in _sections(one.type):
        text.append(f"\n{heading}\n", "bold green")
        text.append("".join(f"{line}\n" for line in _aligned(list(rows))))
    return text


def _sections(kind: RobotType) -> Iterator[tuple[str, Iterable[tuple[str, ...]]]]:
    yield "Line", _line(kind)
    yield "Limits", _limits(kind)
    if kind.asked is not None:
        yield "Requests", _requests(kind)
    yield "Publishes", _published(kind)
    yield "Hears", ((name, message) for name, message in _hears(kind))
    if kind.asked is not None:
        yield "Time of its line at these rates", _budgets(kind)
    yield "When orders stop", _dead_man(kind)


def _line(kind: RobotType) -> Iterator[tuple[str, ...]]:
    link = kind.link
    yield "by", ", ".join(link.kinds)
    others = f" ({', '.join(map(str, link.other_bauds))} can be chosen)" if link.other_bauds else ""
    yield (
        "baud",
        f"{link.baud}{others}, {link.bytesize} data bits, parity {link.parity}, {link.stopbits} stop",
    )
    yield "speaks", _spoken(kind)
    if link.hint:
        yield "if it is silent", printable(link.hint)


def _spoken(kind: RobotType) -> str:
    protocol = kind.protocol
    match protocol.kind:
        case "line":
            lines_ = f"lines of text that end with {protocol.terminator!r}"
            return f"{lines_}; answers within {protocol.reply_timeout:g} s"
        case "binary":
            return f"bytes, {protocol.byte_order}-endian; answers within {protocol.reply_timeout:g} s"
        case "python":
            own = f"what the class {protocol.codec} beside it makes"
            return f"{own}; answers within {protocol.reply_timeout:g} s"
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
    said = " or ".join(map(str, units))
    if said:
        yield f"{said} in its own units"


def _units(kind: RobotType, per_mps: float) -> int:
    return round(kind.kinematics.wheel_speed_max * per_mps)


def _fastest_turn(kind: RobotType) -> float:
    return 2 * kind.kinematics.wheel_speed_max / kind.kinematics.wheel_separation


def _requests(kind: RobotType) -> Iterator[tuple[str, ...]]:
    protocol = kind.asked
    assert protocol is not None
    if protocol.kind == "python":
        yield "set speed", *_sizes(protocol.set_speed)
        for name, coded in protocol.queries.items():
            yield name, *_sizes(coded), _numbers(coded.values)
    else:
        yield "set speed", printable(protocol.set_speed.send), f"-> {protocol.set_speed.reply or 'no reply'}"
        if protocol.kind == "line" and protocol.identify is not None:
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
    topics = driver_topics(kind, kind.settings, "swarmctl")
    for (name, message, rate), alike in groupby(topics, lambda one: (_family(one), one.type, one.rate)):
        elements = [one.name.rpartition("/")[2] for one in alike]
        each = (f"for each of {', '.join(elements)}",) if name.endswith("/") else ()
        yield f"{name}*" if each else name, message, f"{rate:g} Hz", *each
    off = [name for name, rate in rates_of(kind, kind.settings).items() if rate == 0]
    for name in off:
        yield name, MESSAGES[kind.sensors[name].kind], "off; `rates` turns it on"


def _family(topic: DriverTopic) -> str:
    """Its name; the sensor's, with a slash, where each of its elements has a topic."""
    return "".join(topic.name.rpartition("/")[:2]) if topic.part and "/" in topic.name else topic.name


def _hears(kind: RobotType) -> Iterator[tuple[str, str]]:
    if kind.sketch is not None:
        yield from ((one.topic, one.type) for one in kind.sketch.subscribes)
        return
    yield COMMAND, COMMAND_TYPE
    yield from actuators_of(kind).items()


def _loads(kind: RobotType) -> Iterator[tuple[str, lines.Load]]:
    if kind.asked is not None:
        whole, rates = equipped(kind, kind.settings), rates_of(kind, kind.settings)
        for link in kind.link.kinds:
            yield link, lines.load_of(whole, _KINDS[link], kind.link.baud, lines.COMMAND_RATE, rates)


def _budgets(kind: RobotType) -> Iterator[tuple[str, ...]]:
    for name, load in _loads(kind):
        bytes_ = f"{load.needed:.0f} of {load.available:.0f} B/s"
        yield name, f"{load.share:.0%}", bytes_, f"a turn of all requests takes {load.cycle * 1000:.0f} ms"


def _dead_man(kind: RobotType) -> Iterator[tuple[str, ...]]:
    yield "the driver", f"stops it after {command_timeout_of(kind, kind.settings):g} s"
    if kind.sketch is not None:
        yield "the sketch", f"stops it after {kind.sketch.firmware_timeout:g} s"
    itself = "stops by itself as well" if kind.firmware_dead_man else "goes on with its last speed"
    yield "without a driver", f"it {itself}"


def _senses(kind: RobotType) -> list[str]:
    return [one.topic for one in kind.sketch.publishes] if kind.sketch else list(kind.sensors)


def _aligned(rows: list[tuple[str, ...]]) -> Iterator[str]:
    columns: Mapping[int, int] = {
        place: max((len(row[place]) for row in rows if place < len(row)), default=0)
        for place in range(max((len(row) for row in rows), default=0))
    }
    for row in rows:
        cells = (f"{cell:<{columns[place]}}" for place, cell in enumerate(row))
        yield (" " * _LEFT + "  ".join(cells)).rstrip()
