"""Random valid specs: a swarm whose names resolve, and any keys of the schema that leave it valid."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import Any

from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.model import Mode
from tests import ROOT

try:
    from re import _constants, _parser  # type: ignore[attr-defined]
except ImportError:  # Python 3.10
    import sre_constants as _constants
    import sre_parse as _parser

Data = dict[str, Any]
MODES = tuple(one.value for one in Mode)
DISTROS = ("noetic", "humble", "jazzy", "kilted", "lyrical")
KEYS = 8  # of the schema that are tried in one spec
ODD = "aZ9_-. /:;=#%$&'\"\\{}[]()<>|*?~`^@!,+é\U0001f916"
#: Keys whose values are names of the spec.
HOSTS = {"host", "hosts", "hub", "leader", "via", "root", "servers", "builders", "outside"}
ROBOTS = {"robot", "robots", "of"}
_RANGES = re.compile(r"/(Each|RangeOfNames|Selection)$")
#: Keys that need what lies beside a spec, or that turn off what is tried.
LEFT_OUT = {"include", "overlay", "packages", "types", "urdf", "files", "ignore", "version"}


def spec_of(seed: int, is_valid: Callable[[Data], bool]) -> Data | None:
    """Returns the spec of a seed as plain data; none where its swarm has errors even without further keys."""
    rng = random.Random(seed)
    data = _swarm(rng)
    if not is_valid(data):
        return None
    for _ in range(KEYS):
        changed = json.loads(json.dumps(data))
        if _add_key(rng, changed) and is_valid(changed):
            data = changed
    return data


def _swarm(rng: random.Random) -> Data:
    hosts = [f"h{number}" for number in range(rng.randint(1, 4))]
    mode = rng.choice(MODES)
    data: Data = {"version": 1, "name": rng.choice(("lab", "a-b")), "mode": mode}
    if mode in ("single-minded", "leader"):
        data["leader"] = rng.choice(hosts)
    if mode == "central":
        data["hub"] = rng.choice(hosts)
    distro = rng.choice(DISTROS)
    data["ros"] = {"distro": distro, **({} if distro == "noetic" else _graph(rng, hosts))}
    if mode == "combined":
        data["islands"] = _islands(rng, hosts)
    if rng.random() < 0.5:
        data["security"] = rng.choice(("filtered", "sealed"))
    version = "10.0.0.{}" if distro == "noetic" else rng.choice(("10.0.0.{}", "10.0.0.{}", "fd00::{}"))
    data["hosts"] = {name: {"address": version.format(n + 1)} for n, name in enumerate(hosts)}
    data["robots"], lines = {}, []
    for number in range(rng.randint(1, 4)):
        name, host = f"r{number}", data.get("leader") if mode == "single-minded" else rng.choice(hosts)
        kind = rng.choice(_types_for(distro))
        data["robots"][name] = {"type": kind, "host": host}
        if line := _line(rng, number, name, str(host), load_catalog().types[kind]):
            lines.append(line)
            if line["kind"] == "bluetooth":
                data["hosts"][host]["bluetooth"] = ["hci0"]
    data["links"] = [*_networks(rng, hosts), *lines]
    data["programs"] = {f"p{number}": _program(rng, hosts, data) for number in range(rng.randint(0, 3))}
    data["control"] = list(_control(rng, data))
    if distro == "noetic" and rng.random() < 0.4:
        data["multimaster"] = {"provider": rng.choice(("fkie", "static"))}
    return data


def _types_for(distro: str) -> list[str]:
    """The types of the catalog that a distribution has a driver for."""
    types = load_catalog().types
    return sorted(
        name
        for name, one in types.items()
        if any(driver.is_for(distro) for driver in getattr(one, "drivers", ()))
        or not isinstance(one, RosRobotType)
    )


def _graph(rng: random.Random, hosts: list[str]) -> Data:
    rmw = rng.choice(("fastrtps", "fastrtps", "cyclonedds", "zenoh"))
    methods = {
        "fastrtps": ("peers", "server", "multicast"),
        "cyclonedds": ("peers", "multicast"),
        "zenoh": ("zenoh",),
    }
    found: Data = {"rmw": rmw, "discovery": rng.choice(methods[rmw])}
    if found["discovery"] in ("server", "zenoh") and rng.random() < 0.5:
        found["servers"] = rng.sample(hosts, rng.randint(1, min(2, len(hosts))))
    elif rng.random() < 0.2 and found["discovery"] == "peers":
        found["sros2"] = True
    return found


def _islands(rng: random.Random, hosts: list[str]) -> Data:
    cut = rng.randint(0, len(hosts) - 1)
    return {
        f"i{number}": {"mode": "central", "hosts": group, "hub": rng.choice(group)}
        for number, group in enumerate(one for one in (hosts[:cut], hosts[cut:]) if one)
    }


def _networks(rng: random.Random, hosts: list[str]) -> list[Data]:
    kind = rng.choice(("wlan", "ethernet"))
    return [{"kind": kind, "name": "lab", "hosts": hosts, "multicast": rng.random() < 0.7}]


def _line(rng: random.Random, number: int, robot: str, host: str, kind: Any) -> Data | None:
    link = getattr(kind, "link", None)
    kinds = link.kinds if link is not None else getattr(kind, "link_kinds", ())
    common = {"host": host, "robot": robot}
    forms: Mapping[str, Data] = {
        "serial": {"usb": {"serial": f"A{number}"}},
        "bluetooth": {"mac": f"10:00:00:00:00:{number:02d}"},
        "udp": {"address": f"10.0.9.{number + 1}"},
        "tcp": {"address": f"10.0.9.{number + 1}"},
        "radio": {"uri": f"radio://0/{10 * number + 10}/2M/E7E7E7E70{number}"},
    }
    usable = [one for one in kinds if one in forms]
    if not usable:
        return None
    chosen = rng.choice(usable)
    return {"kind": chosen, **common, **forms[chosen]}


def _program(rng: random.Random, hosts: list[str], data: Data) -> Data:
    place = {"host": data.get("leader") or rng.choice(hosts)}
    if data["mode"] not in ("leader", "single-minded") and rng.random() < 0.4:
        place = {"robot": rng.choice(list(data["robots"]))}
    what: Data = rng.choice((
        {"use": "teleop-joy"},
        {"use": "teleop-key"},
        {"package": "demo", "executable": "node"},
        {"package": "demo", "executable": "node.py", "params": _parameters(rng)},
        {"package": "demo", "launch": "a.launch" if data["ros"]["distro"] == "noetic" else "a.launch.py"},
        {"command": ["/usr/bin/env", "x", _text(rng)]},
        {"container": {"image": "sha256:" + "5" * 64}},
    ))  # fmt: skip
    return {**place, **what}


def _control(rng: random.Random, data: Data) -> Iterator[Data]:
    """Programs command robots, in modes of several islands those of their host."""
    free = dict(data["robots"])
    for name, one in data["programs"].items():
        host = one.get("host") or data["robots"][one["robot"]]["host"]
        several = data["mode"] in ("standalone", "combined")
        of = [robot for robot, given in free.items() if given["host"] == host or not several]
        if of and not {"command", "container", "launch"} & set(one):
            chosen = rng.sample(of, rng.randint(1, len(of)))
            free = {robot: given for robot, given in free.items() if robot not in chosen}
            yield {"by": name, "of": chosen}


def _parameters(rng: random.Random) -> Data:
    return {f"k{number}": _parameter(rng) for number in range(rng.randint(1, 4))}


def _parameter(rng: random.Random, depth: int = 0) -> Any:
    scalars: tuple[Callable[[], Any], ...] = (
        lambda: rng.random() < 0.5,
        lambda: rng.randint(-9, 1 << rng.randint(1, 66)),
        lambda: round(rng.uniform(-1e3, 1e3), rng.randint(0, 9)),
        lambda: _text(rng),
    )
    if depth < 2 and rng.random() < 0.3:
        if rng.random() < 0.5:
            return [rng.choice(scalars)() for _ in range(rng.randint(0, 3))]
        return {f"k{number}": _parameter(rng, depth + 1) for number in range(rng.randint(1, 3))}
    return rng.choice(scalars)()


def _text(rng: random.Random) -> str:
    return "".join(rng.choice(ODD) for _ in range(rng.randint(0, 12)))


@cache
def _schema() -> Data:
    found: Data = json.loads((ROOT / "schemas/swarm.schema.json").read_text("utf-8"))
    return found


def _resolved(schema: Data) -> Data:
    while "$ref" in schema:
        schema = _schema()["definitions"][schema["$ref"].rpartition("/")[2]]
    return schema


def _add_key(rng: random.Random, data: Data) -> bool:
    """Adds a key of the schema with a value of its type somewhere; False where there is none to add."""
    places = [one for one in _places(data, _schema()) if one[1]]
    if not places:
        return False
    place, missing = rng.choice(places)
    key, schema = rng.choice(missing)
    place[key] = _sample(rng, key, schema, data)
    return True


def _places(value: Any, schema: Data) -> Iterator[tuple[Data, list[tuple[str, Data]]]]:
    """Yields each mapping of a spec, and the keys that it has not."""
    schema = _resolved(schema)
    if isinstance(value, dict):
        for branch in _branches(schema, value):
            known = branch.get("properties", {})
            yield (
                value,
                [(key, one) for key, one in known.items() if key not in value and key not in LEFT_OUT],
            )
            for key, one in value.items():
                below = known.get(key) or next(
                    (
                        found
                        for pattern, found in branch.get("patternProperties", {}).items()
                        if re.search(pattern, key)
                    ),
                    branch.get("additionalProperties"),
                )
                if isinstance(below, dict):
                    yield from _places(one, below)
    elif isinstance(value, list):
        for branch in _branches(schema, value):
            for one in value:
                yield from _places(one, branch.get("items", {}))


def _branches(schema: Data, value: Any) -> list[Data]:
    """The forms of a schema that a value can have."""
    schema = _resolved(schema)
    forms = [_resolved(one) for one in schema.get("anyOf", schema.get("oneOf", [schema]))]
    if isinstance(value, dict):
        kind = value.get("kind")
        found = [
            one for one in forms if one.get("type") == "object" and set(one.get("required", ())) <= set(value)
        ]
        return [
            one
            for one in found
            if kind is None or one.get("properties", {}).get("kind", {}).get("const", kind) == kind
        ][:1]
    return [one for one in forms if one.get("type") == "array"][:1]


def _sample(rng: random.Random, key: str, schema: Data, data: Data) -> Any:
    """A value for a key: a name of the spec, an example, or what its type allows."""
    schema = _resolved(schema)
    forms = [
        one
        for one in schema.get("anyOf", schema.get("oneOf", ()))
        if not _RANGES.search(str(one.get("$ref")))
    ]
    if forms:
        return _sample(rng, key, rng.choice(forms), data)
    names = list(data["hosts"]) if key in HOSTS else list(data["robots"]) if key in ROBOTS else []
    if schema.get("type") == "string" and names:
        return rng.choice(names)
    if "const" in schema or "enum" in schema:
        return rng.choice(schema.get("enum", [schema.get("const")]))
    if "examples" in schema and rng.random() < 0.4 and not names:
        return rng.choice(schema["examples"])
    return _of_type(rng, key, schema, data)


def _of_type(rng: random.Random, key: str, schema: Data, data: Data) -> Any:
    least, kinds = schema.get("minItems", 0), schema.get("type", "any")
    made: Mapping[str, Callable[[], Any]] = {
        "boolean": lambda: rng.random() < 0.5,
        "integer": lambda: _number(rng, schema, whole=True),
        "number": lambda: _number(rng, schema, whole=False),
        "array": lambda: [
            _sample(rng, key, schema.get("items", {}), data) for _ in range(rng.randint(least, max(least, 2)))
        ],
        "object": lambda: _mapping(rng, schema, data),
        "string": lambda: _matching(rng, schema["pattern"]) if "pattern" in schema else _text(rng),
    }
    kind = rng.choice(kinds) if isinstance(kinds, list) else kinds
    return made.get(kind, lambda: _parameter(rng))()


def _mapping(rng: random.Random, schema: Data, data: Data) -> Data:
    known = {key: one for key, one in schema.get("properties", {}).items() if key not in LEFT_OUT}
    chosen = {key for key in known if rng.random() < 0.2} | set(schema.get("required", ())) & set(known)
    found = {key: _sample(rng, key, known[key], data) for key in sorted(chosen)}
    of_names = next(iter(schema.get("patternProperties", {}).items()), None)
    if of_names is not None and not known:
        pattern, one = of_names
        found |= {_matching(rng, pattern): _sample(rng, "", one, data) for _ in range(rng.randint(1, 2))}
    return found


def _number(rng: random.Random, schema: Data, *, whole: bool) -> float:
    low: float = schema.get("minimum", schema.get("exclusiveMinimum", -100.0))
    high: float = schema.get("maximum", schema.get("exclusiveMaximum", max(low, 1) * 100))
    if whole:
        return rng.choice((low, high, rng.randint(int(low), int(high))))
    return rng.choice(
        (schema.get("minimum", (low + high) / 2), rng.uniform(low, high), round(rng.uniform(low, high), 1))
    )


def _matching(rng: random.Random, pattern: str) -> str:
    """A text that a pattern of the schema matches; look-arounds are left to chance."""
    return "".join(_parts(rng, _parser.parse(pattern)))[:60]


def _parts(rng: random.Random, parsed: Any) -> Iterator[str]:
    for operator, argument in parsed:
        if operator is _constants.LITERAL:
            yield chr(argument)
        elif operator is _constants.NOT_LITERAL:
            yield rng.choice([one for one in ODD if ord(one) != argument])
        elif operator is _constants.ANY:
            yield rng.choice(ODD)
        elif operator is _constants.IN:
            yield _of_class(rng, argument)
        elif operator in (_constants.MAX_REPEAT, _constants.MIN_REPEAT):
            least, most, inner = argument
            for _ in range(rng.randint(least, min(most, least + 6))):
                yield from _parts(rng, inner)
        elif operator is _constants.SUBPATTERN:
            yield from _parts(rng, argument[-1])
        elif operator is _constants.BRANCH:
            yield from _parts(rng, rng.choice(argument[1]))


def _of_class(rng: random.Random, items: Any) -> str:
    if items[0][0] is _constants.NEGATE:
        pattern = re.compile("[^" + "".join(_escaped(one) for one in items[1:]) + "]")
        return rng.choice([one for one in ODD if pattern.fullmatch(one)])
    operator, argument = rng.choice(items)
    if operator is _constants.RANGE:
        return chr(rng.randint(*argument))
    return chr(argument) if operator is _constants.LITERAL else "7"


def _escaped(item: Any) -> str:
    operator, argument = item
    ends = argument if operator is _constants.RANGE else (argument, argument)
    return (
        "-".join(re.escape(chr(one)) for one in ends)
        if isinstance(ends, tuple) and isinstance(ends[0], int)
        else ""
    )
