"""What the files of a lab have that a spec has not."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from swarmctl.importing.draft import Draft, Entry, Value
from swarmctl.importing.unknown_values import is_secret
from swarmctl.spec.model import Spec
from swarmctl.swarm.names import robot_namespace
from swarmctl.yamltext.scalars import literal

_OF_ALL = ("name", "mode", "leader", "hub")  # that a draft guesses
_KINDS = ("package", "executable", "launch", "command", "use")  # what a program is


def beyond(draft: Draft, spec: Spec) -> Draft:
    """Returns the part of a draft that a spec has not; a value that it has otherwise says which one it has.

    A host of the spec is known by its address or name, a robot by its namespace or name, a program by its
    name, or by what it starts in which namespace.
    """
    given = spec.model_dump(mode="json", by_alias=True, exclude_unset=True)
    hosts = _same(draft.hosts, given.get("hosts", {}), lambda _name, one: [one.get("address")])
    robots = _same(draft.robots, given.get("robots", {}), lambda name, one: [_namespace(name, one)])
    programs = _same(
        draft.programs, given.get("programs", {}), lambda _name, one: [_started(one, hosts, robots)]
    )
    names = {"host": hosts, "robot": robots}
    found = Draft(draft.source, name=draft.name)
    found.hosts = _left(draft.hosts, given.get("hosts", {}), hosts, names)
    found.robots = _left(draft.robots, given.get("robots", {}), robots, names)
    found.programs = _left(draft.programs, given.get("programs", {}), programs, names)
    of_all = {
        key: replace(one, value=_renamed(one.value, hosts))
        for key, one in {**draft.first, **draft.last}.items()
        if key not in _OF_ALL
    }
    found.first = _fields(of_all, given, {})
    found.multimaster = _fields(draft.multimaster, given.get("multimaster") or {}, {})
    linked = {one.robot for one in spec.links if hasattr(one, "robot")}
    found.lines = [one for one in draft.lines if robots.get(one.value["robot"]) not in linked]
    found.networks = [
        one for one in draft.networks if not {hosts.get(name) for name in one.value["hosts"]} <= {*spec.hosts}
    ]
    return found


def _same(entries: Mapping[str, Entry], given: Mapping[str, Any], keys: Any) -> dict[str, str]:
    """The names in the spec of what both have."""
    known: dict[str, list[str]] = {}
    for name, one in given.items():
        for key in filter(None, keys(name, one)):
            known.setdefault(json.dumps(key), []).append(name)
    found: dict[str, str] = {}
    for name, entry in entries.items():
        own = {key: one.value for key, one in entry.fields.items() if not one.fill_in}
        alike = [same for key in keys(name, own) for same in known.get(json.dumps(key), ())]
        if name in given and (name in alike or not alike):
            found[name] = name
        elif alike:
            found[name] = alike[0]
    return found


def _renamed(value: Any, hosts: Mapping[str, str]) -> Any:
    """A value with the names that hosts have in the spec."""
    if isinstance(value, Mapping):
        return {key: _renamed(one, hosts) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_renamed(one, hosts) for one in value]
    return hosts.get(value, value) if isinstance(value, str) else value


def _namespace(name: str, robot: Mapping[str, Any]) -> str:
    return robot_namespace(name, robot.get("namespace"))


def _started(program: Mapping[str, Any], hosts: Mapping[str, str], robots: Mapping[str, str]) -> list[Any]:
    """What a program starts, and where; nothing for a container, whose image a draft does not know."""
    if not any(key in program for key in _KINDS):
        return []
    robot, host = program.get("robot", ""), program.get("host", "")
    where = ["robot", robots.get(robot, robot)] if robot else ["host", hosts.get(host, host)]
    return [*(program.get(key) for key in _KINDS), program.get("namespace"), *where]


def _left(
    entries: Mapping[str, Entry],
    given: Mapping[str, Any],
    same: Mapping[str, str],
    names: Mapping[str, Mapping[str, str]],
) -> dict[str, Entry]:
    """The entries that are not in the spec, and of those that are, the values that are not."""
    found: dict[str, Entry] = {}
    for name, entry in entries.items():
        if name not in same:
            found[name] = entry
        elif fields := _fields(entry.fields, given[same[name]], names):
            found[same[name]] = Entry(replace(entry.name, value=same[name], was=""), fields)
    return found


def _fields(
    fields: Mapping[str, Value], given: Mapping[str, Any], names: Mapping[str, Mapping[str, str]]
) -> dict[str, Value]:
    """The values that the spec has not; ``names`` has those of its hosts and robots by key."""
    found: dict[str, Value] = {}
    for key, one in fields.items():
        value = names.get(key, {}).get(str(one.value), one.value)
        if one.fill_in or not (one.place or key not in given):
            continue
        left = _beyond(value, given.get(key))
        if left is not None:
            instead = literal(given[key]) if key in given and not isinstance(left, dict) else ""
            found[key] = replace(one, value=left, instead="" if is_secret(key, instead) else instead)
    return found


def _beyond(mine: Any, given: Any) -> Any:
    """What of a value is not in the spec's; None if all of it is."""
    if isinstance(mine, Mapping) and isinstance(given, Mapping):
        left = {key: _beyond(one, given.get(key)) for key, one in mine.items()}
        return {key: one for key, one in left.items() if one is not None} or None
    return None if json.dumps(mine, default=str) == json.dumps(given, default=str) else mine
