"""Drafts robots and their radios from crazyflies.yaml of crazyswarm2."""

from __future__ import annotations

from collections.abc import Iterator

import yaml
from pydantic import TypeAdapter, ValidationError

from swarmctl.field_types import RadioUri
from swarmctl.importing.draft import Draft, Entry, Value, named
from swarmctl.importing.lab_folder import YAML, LabFolder
from swarmctl.importing.lab_hosts import EXAMPLE, LabHosts
from swarmctl.importing.unknown_values import is_secret
from swarmctl.importing.yaml_values import Keys, YamlValues, child_of, is_empty, quoted
from swarmctl.links.radio_link import Radio
from swarmctl.swarm.names import robot_namespace
from swarmctl.yamltext.compose import compose, is_plain, pairs_of
from swarmctl.yamltext.files import LoadBudget
from swarmctl.yamltext.scalars import WORDS, number_or_text

_TYPE = "crazyflie"
_PACKAGE, _SERVER = "crazyflie", "crazyflie_server"  # of which there are several
_URI: TypeAdapter[str] = TypeAdapter(RadioUri)
_SECTIONS = {"robots": 3, "robot_types": 2, "all": 2}  # how deep the keys lie that are named


def is_crazyflies(root: yaml.Node | None) -> bool:
    """Returns True if the top of a YAML file has `robots`, one of them with a `uri`."""
    robots = pairs_of(child_of(root, "robots")).values()
    return any("uri" in pairs_of(robot) for _, robot in robots)


def add_all_crazyflies(draft: Draft, hosts: LabHosts, folder: LabFolder) -> None:
    """Adds the robots of each crazyflies.yaml of a folder, and a host if there is none."""
    for path, root in _files(folder):
        if not draft.hosts:
            why = "no file names a computer; write each"
            address = {"address": Value(EXAMPLE, fill_in=why)}
            hosts.new("robot-pc", None, address, "it has the Crazyradio")
        why = "no file names the host of their radio; this is the "
        host = Value(next(iter(draft.hosts)), guess=why + ("first" if len(draft.hosts) > 1 else "only one"))
        add_crazyflies(draft, host, path, root)
        draft.source += f", {path}"
        _remove_servers(draft)


def _remove_servers(draft: Draft) -> None:
    """Takes out the servers of crazyswarm2 that launch files start: each robot has one of its own."""
    for name, one in list(draft.programs.items()):
        package, executable = (one.fields.get(key, Value("")).value for key in ("package", "executable"))
        if package == _PACKAGE and str(executable).startswith(_SERVER):
            why = f"{executable}: the driver of each Crazyflie replaces it"
            draft.unread.append(f"{one.name.place}: {why}" if one.name.place else why)
            del draft.programs[name]


def _files(folder: LabFolder) -> Iterator[tuple[str, yaml.Node]]:
    for path in sorted(folder.candidates()):
        if path.endswith(YAML):
            root, _ = compose(folder.texts[path], path, LoadBudget())
            if root is not None and is_crazyflies(root):
                yield path, root


def add_crazyflies(draft: Draft, host: Value, path: str, root: yaml.Node) -> None:
    """Adds the robots of a crazyflies.yaml with their radios of ``host``, and lists what else it has."""
    values = YamlValues(path, root)
    robots = child_of(root, "robots")
    for name, (at, robot) in reversed(pairs_of(robots).items()):
        enabled = _boolean(values, robot, "enabled")
        uri = values.find(robot, "uri")
        if enabled is False or uri is None:
            why = "it is not enabled" if enabled is False else "it has no uri"
            draft.unread.append(f"{values.place(at)}: robot {quoted(name)}: {why}")
            values.take_whole(at)
        else:
            _add_robot(draft, host, values, Value(name, values.place(at)), robot)
    draft.unread += values.left(_is_section, lambda keys: "")


def _is_section(keys: Keys) -> bool:
    return len(keys) >= _SECTIONS.get(keys[0], 1)


def _boolean(values: YamlValues, robot: yaml.Node, key: str) -> bool | None:
    """The value of a key that is true or false; None for any other one."""
    found = values.find(robot, key)
    meaning = WORDS.get(str(found.value)) if found else None
    if not isinstance(meaning, bool):
        return None
    values.take(robot, key)
    return meaning


def _add_robot(draft: Draft, host: Value, values: YamlValues, called: Value, robot: yaml.Node) -> None:
    text = str(called.value)
    name = named(text, "robot", called.place, draft.robots)
    kind, uri = values.take(robot, "type"), values.take(robot, "uri")
    guess = "crazyswarm2 drives Crazyflies"
    if kind:
        guess += f", and {quoted(str(kind.value))} is one of its robot_types"
    fields = {"type": Value(_TYPE, kind.place if kind else None, guess), "host": host}
    if robot_namespace(name.value, None) != f"/{text}":
        fields["namespace"] = Value(text, called.place)
    if start := _start(draft, values, robot, name.value):
        fields["start"] = start
    draft.robots[name.value] = Entry(name, fields)
    if uri:
        draft.lines.append(_radio(uri, host.value, name.value))


def _radio(uri: Value, host: str, robot: str) -> Value:
    """The link of a robot; to fill in if it is no Crazyradio."""
    ends, text = {"kind": "radio", "host": host, "robot": robot}, str(uri.value)
    if is_secret("", text):
        why = "its uri may have a secret"
    else:
        try:
            full = _URI.validate_python(text)
            return Value({**ends, "uri": full}, uri.place, was=text if text != full else "")
        except ValidationError as error:
            why = error.errors()[0]["msg"].removeprefix("Value error, ")
    return Value({**ends, **Radio.unknown_end}, fill_in=f"{uri.place}: {why}")


def _start(draft: Draft, values: YamlValues, robot: yaml.Node, name: str) -> Value | None:
    """Where a robot stands, if its position has an x and a y; lists what else the position has."""
    at, position = pairs_of(robot).get("initial_position", (None, None))
    if at is None or not isinstance(position, yaml.SequenceNode) or is_empty(position):
        return None
    numbers = [number_or_text(one.value) if is_plain(one) else None for one in position.value]
    x, y, *_ = *numbers, None, None
    if not isinstance(x, int | float) or not isinstance(y, int | float):
        return None
    values.take_whole(position)
    for node, one in list(zip(position.value, numbers, strict=True))[2:]:
        if one != 0:
            why = f"a robot starts at x and y, and initial_position of robot `{name}` has more"
            draft.unread.append(f"{values.place(node)}: {why}")
    return Value({"x": float(x), "y": float(y)}, values.place(at))
