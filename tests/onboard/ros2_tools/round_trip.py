"""Runs on a host: messages of every type to YAML and back, and the values of a table, as JSON."""

import json
import random
import sys
from importlib import import_module

sys.path.insert(0, "/gate")
import yaml
from rclpy.serialization import deserialize_message, serialize_message
from swarm_onboard.ros2.ros1_bytes import LIST, message_class
from swarm_onboard.ros2_tools.message_yaml import filled, text

PACKAGES = ("builtin_interfaces", "diagnostic_msgs", "geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs")
TEXTS = ("", "yes", "1e5", "---", "a: b", "é", "a\n---\nb", "\ta", " ", "#", '"', "it's", "null", "\x1b[2J")
FLOATS = (0.0, -1.5, 1e-7, 3e38, float("inf"), float("-inf"))
EACH = 20
NOW = message_class("builtin_interfaces/Time")(sec=7, nanosec=8)
chance = random.Random(7)


def drawn(kind):
    """A value of a field."""
    found = LIST.fullmatch(kind)
    if found:
        count = found["count"] or chance.randint(0, min(int(found["bound"] or 4), 4))
        return [drawn(found["any"] or found["some"]) for _ in range(int(count))]
    if kind.startswith(("int", "uint")):
        bits = int(kind.lstrip("uint"))
        low = 0 if kind[0] == "u" else -(1 << bits - 1)
        return chance.choice((low, low + (1 << bits) - 1, chance.randint(low, low + (1 << bits) - 1)))
    simple = {
        "boolean": lambda: chance.random() < 0.5,
        "octet": lambda: bytes([chance.randrange(256)]),
        "float": lambda: chance.choice(FLOATS),
        "double": lambda: chance.choice((*FLOATS, 1e300, chance.random())),
        "string": lambda: chance.choice(TEXTS),
        "wstring": lambda: chance.choice(TEXTS),
    }
    return simple[kind]() if kind in simple else message(message_class(kind))


def message(kind):
    made = kind()
    for name, field in kind.get_fields_and_field_types().items():
        setattr(made, name, drawn(field))
    return made


def sent(one):
    """The message as others get it."""
    return deserialize_message(serialize_message(one), type(one))


def failures():
    for package in PACKAGES:
        module = import_module(f"{package}.msg")
        for name in [one for one in vars(module) if one[0].isupper()]:
            kind = getattr(module, name)
            for one in [kind(), *(message(kind) for _ in range(EACH))]:
                shown = text(one)
                again = filled(kind, yaml.safe_load(shown), NOW)
                good = sent(again) == sent(one) and "---" not in shown.split("\n")
                yield f"{package}/{name}", "" if good else shown


def result(kind, values):
    try:
        return text(filled(message_class(kind), yaml.safe_load(values), NOW))
    except ValueError as error:
        return str(error)


found = list(failures())
print(
    json.dumps(
        {
            "types": sorted({name for name, _ in found}),
            "failures": [one for one in found if one[1]],
            "values": [result(*one) for one in json.loads(sys.argv[1])],
        }
    )
)
