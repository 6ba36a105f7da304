"""Values that cannot be, or that contradict the rest of the swarm."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import pairwise

from tests.mutations.defects import MISTAKES, Change, mistake, written
from tests.mutations.places import File, Place

Slip = Callable[[str], str]


def _at(places: tuple[str, ...], slip: Slip) -> Callable[[File], Iterator[Change]]:
    def changes(file: File) -> Iterator[Change]:
        for place in file.scalars(*places):
            if place.value and "[" not in place.value and slip(place.value) != place.value:
                yield written(file, place, slip(place.value))

    return changes


def _octet(address: str, number: int, octet: str) -> str:
    parts = address.split(".")
    return ".".join([*parts[:number], octet, *parts[number + 1 :]]) if len(parts) == 4 else address


_NUMBERS = (
    *("links.*.baud", "ros.master_port", "control.*.priority", "programs.*.memory_mb", "link.baud"),
    *("programs.*.publishes.*.rate", "kinematics.*", "sensors.*.rate", "protocol.reply_timeout"),
)
_BOOLEANS = ("links.*.multicast", "programs.*.optional", "robots.*.optional", "firmware_dead_man")
_TOPICS = ("programs.*.publishes.*.topic", "programs.*.subscribes.*.topic")
_TYPES = ("programs.*.publishes.*.type", "programs.*.subscribes.*.type")


def _separated(number: str) -> str:
    return f"{number[:-3]},{number[-3:]}" if len(number) > 4 and "." not in number else number


SLIPS: Mapping[str, tuple[tuple[str, ...], Slip]] = {
    "address: an octet above 255": (("hosts.*.address",), lambda old: _octet(old, 3, "300")),
    "address: an octet is missing": (("hosts.*.address",), lambda old: old.rpartition(".")[0]),
    "address: commas for dots": (("hosts.*.address",), lambda old: f'"{old.replace(".", ",")}"'),
    "address: another network": (("hosts.*.address",), lambda old: _octet(old, 2, "78")),
    "address: with a port": (("hosts.*.address",), lambda old: f"{old}:11311"),
    "address: with a mask": (("hosts.*.address",), lambda old: f"{old}/24"),
    "address: the network itself": (("hosts.*.address",), lambda old: _octet(old, 3, "0")),
    "address: broadcast": (("hosts.*.address",), lambda old: _octet(old, 3, "255")),
    "address: loopback": (("hosts.*.address",), lambda _: "127.0.0.1"),
    "address: a URI": (("hosts.*.address",), lambda old: f"http://{old}:11311"),
    "address: letter O for 0": (("hosts.*.address",), lambda old: old.replace("10", "1O", 1)),
    "account: with a host": (("hosts.*.user",), lambda old: f"{old}@pi"),
    "account: empty": (("hosts.*.user",), lambda _: '""'),
    "baud: a digit is missing": (("links.*.baud",), lambda old: old[:-1]),
    "baud: a digit too many": (("links.*.baud",), lambda old: old + "0"),
    "baud: another rate": (("links.*.baud",), lambda _: "57600"),
    "MAC: a byte is missing": (("links.*.mac",), lambda old: f'"{old[:-3]}"'),
    "MAC: not hexadecimal": (("links.*.mac",), lambda old: f'"{old[:-1]}g"'),
    "USB: a path for the serial number": (("links.*.usb.serial",), lambda _: "/dev/ttyUSB0"),
    "USB: empty": (("links.*.usb.serial",), lambda _: '""'),
    "USB: vendor without its zero": (("links.*.usb.vendor",), lambda old: f'"{old.lstrip("0")}"'),
    "PIN: the PIN itself": (("links.*.pin.secret",), lambda _: "1234"),
    "version: the next": (("version",), lambda _: "2"),
    "version: a decimal number": (("version",), lambda _: "1.0"),
    "boolean: misspelt": (_BOOLEANS, lambda _: "ture"),
    "boolean: in quotes": (_BOOLEANS, lambda old: f'"{old}"'),
    "boolean: a number": (_BOOLEANS, lambda _: "1"),
    "boolean: enabled": (_BOOLEANS, lambda _: "enabled"),
    "number: in quotes": (_NUMBERS, lambda old: f'"{old}"'),
    "number: negative": (_NUMBERS, lambda old: f"-{old}"),
    "number: a decimal comma": (_NUMBERS, lambda old: old.replace(".", ",")),
    "number: thousands separated": (_NUMBERS, _separated),
    "number: an unknown unit": (_NUMBERS, lambda old: f"{old} furlongs"),
    "number: empty": (_NUMBERS, lambda _: ""),
    "number: a word": (_NUMBERS, lambda _: "fast"),
    "rate: zero": (("programs.*.publishes.*.rate",), lambda _: "0"),
    "topic: with a space": (_TOPICS, lambda old: f"{old} raw"),
    "topic: two slashes": (_TOPICS, lambda old: f"{old}//raw"),
    "topic: a slash at its end": (_TOPICS, lambda old: f"{old}/"),
    "topic: begins with a digit": (("programs.*.publishes.*.topic",), lambda old: f"1{old.lstrip('/')}"),
    "topic: with a hyphen": (_TOPICS, lambda old: f"{old}-raw"),
    "topic: misspelt where it is subscribed": (("programs.*.subscribes.*.topic",), lambda old: old[:-1]),
    "type: without its package": (_TYPES, lambda old: old.partition("/")[2]),
    "type: lower case": (_TYPES, str.lower),
    "type: a letter is missing": (_TYPES, lambda old: old[:-2] + old[-1]),
    "type: another package": (_TYPES[:1], lambda old: "std_msgs/" + old.partition("/")[2]),
    "type: as in C++": (("programs.*.publishes.*.type",), lambda old: old.replace("/", "::")),
    "type: as in ROS 2": (("programs.*.publishes.*.type",), lambda old: old.replace("/", "/msg/")),
    "package: with a hyphen": (("programs.*.package",), lambda old: old + "-ros"),
    "executable: with a path": (("programs.*.executable",), lambda old: f"scripts/{old}"),
    "launch: without its suffix": (("programs.*.launch",), lambda old: old.removesuffix(".launch")),
    "priority: above 255": (("control.*.priority",), lambda _: "1000"),
    "port: above 65535": (("ros.master_port",), lambda _: "113111"),
    "subnet: a mask in words": (("links.*.subnet",), lambda old: old.replace("/24", "/255.255.255.0")),
    "subnet: another network": (("links.*.subnet",), lambda old: old.replace("192.168", "192.186")),
    "subnet: without a mask": (("links.*.subnet",), lambda old: old.partition("/")[0]),
    "text: not closed": (("name", "hosts.*.user"), lambda old: f'"{old}'),
    "name of the swarm: with a space": (("name",), lambda old: f"{old} lab"),
    "a list where one word belongs": (("robots.*.host", "links.*.host", "leader"), lambda old: f"[{old}]"),
    "nothing where a word belongs": (("robots.*.type", "mode", "links.*.kind"), lambda _: ""),
}  # fmt: skip
for _title, (_places, _slip) in SLIPS.items():
    MISTAKES[_title] = _at(_places, _slip)


@mistake("one word where a list belongs")
def _no_list(file: File) -> Iterator[Change]:
    for place in file.values("hosts.*.bluetooth", "control.*.of", "links.*.hosts", "programs.*.requires"):
        text = file.text[place.start : place.end]
        if text.startswith("["):
            yield written(file, place, text[1:-1].partition(",")[0])


def _equal(*pattern: str) -> Callable[[File], Iterator[Change]]:
    """Writes what stands at the first place at each other one, too."""

    def changes(file: File) -> Iterator[Change]:
        places = [one for one in file.scalars(*pattern) if one.value and "[" not in one.value]
        for first, other in pairwise(places):
            yield written(file, other, file.text[first.start : first.end], first.line)

    return changes


MISTAKES["two hosts with one address"] = _equal("hosts.*.address")
MISTAKES["two lines with one USB adapter"] = _equal("links.*.usb.serial")
MISTAKES["two robots with one MAC"] = _equal("links.*.mac")


@mistake("another mode")
def _other_mode(file: File) -> Iterator[Change]:
    role = {line for key in ("leader", "hub", "islands") for one in file.names(key) for line in [one.line]}
    hosts = {one.line for one in file.names("hosts")}
    for place in file.scalars("mode"):
        for mode in ("single-minded", "leader", "central", "standalone", "combined"):
            if mode != place.value:
                yield written(file, place, mode, *role, *hosts, *_commander_lines(file))


def _commander_lines(file: File) -> Iterator[int]:
    return (one.line for one in file.values("control.*", "programs.*", "robots.*", "links.*"))


@mistake("another type of robot")
def _other_type(file: File) -> Iterator[Change]:
    """A robot of a type that its line cannot serve."""
    for place in file.scalars("robots.*.type"):
        lines = file.line_of(f"robot: {place.loc[1]},")
        other = "arduino-rover" if place.value == "epuck" else "epuck2"
        if place.value:
            yield written(file, place, other, *lines)


@mistake("another kind of line")
def _other_kind_of_line(file: File) -> Iterator[Change]:
    for place in file.scalars("links.*.kind"):
        if place.value in ("serial", "bluetooth"):
            yield written(file, place, "bluetooth" if place.value == "serial" else "serial")


def _scaled(places: tuple[str, ...], factor: float) -> Callable[[File], Iterator[Change]]:
    def changes(file: File) -> Iterator[Change]:
        for place in file.scalars(*places):
            number = float(place.value or 0)
            if number:
                yield written(file, place, f"{number * factor:.6g}")

    return changes


_LENGTHS = ("kinematics.wheel_separation", "kinematics.wheel_radius", "kinematics.wheel_speed_max")
_SCALES = ("kinematics.scales.*.speed_units_per_mps", "kinematics.scales.*.metres_per_count")
_POSITIONS = ("sensors.*.elements.*.x", "sensors.*.elements.*.y")
for _factor, _unit in ((1000.0, "in mm"), (100.0, "in cm"), (0.001, "in km"), (10.0, "a zero too many")):
    MISTAKES[f"a length {_unit}"] = _scaled(_LENGTHS, _factor)
    MISTAKES[f"a scale {_unit}"] = _scaled(_SCALES, _factor)
for _factor, _unit in ((1000.0, "in mm"), (100.0, "in cm")):
    MISTAKES[f"a position {_unit}"] = _scaled(_POSITIONS, _factor)
MISTAKES["an angle in tenths of degrees"] = _scaled(("sensors.*.elements.*.heading_deg",), 10.0)
MISTAKES["a time in ms"] = _scaled(("protocol.reply_timeout",), 1000.0)
MISTAKES["a rate per minute"] = _scaled(("sensors.*.rate",), 60.0)
MISTAKES["a battery in mV"] = _scaled(("sensors.*.empty", "sensors.*.full"), 1000.0)
MISTAKES["a counter of 16 bits"] = _at(("kinematics.counter_bits",), lambda _: "8")


@mistake("a query of another sensor")
def _other_query(file: File) -> Iterator[Change]:
    reads: list[Place] = list(file.scalars("sensors.*.read"))
    for place in reads:
        yield written(file, place, "distance", words=(str(place.value),))


@mistake("a reply with another number of values")
def _values(file: File) -> Iterator[Change]:
    sensors = [one.line for one in file.names("sensors.*")]
    for place in file.scalars("protocol.queries.*.values"):
        yield written(file, place, str(int(place.value or 0) - 1), *sensors)
