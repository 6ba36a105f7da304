"""Reads an inventory in Ansible's INI format, as docs.ansible.com documents it, without running anything."""

from __future__ import annotations

import posixpath
import re
import shlex

from swarmctl.importing.draft import Unread
from swarmctl.importing.inventory import COMPUTED, Inventory, Variable, expanded, without_port
from swarmctl.ros_packages.launched import Place

_SECTION = re.compile(r"\[([^\[\]:]+)(?::(hosts|children|vars))?\]\s*(?:[#;].*)?")
_LONGEST = 10_000  # characters of a line
_SHELL = re.compile(r"[\"'\\#]")  # without these characters, spaces alone separate words
_WORD = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def is_ini_inventory(path: str, text: str) -> bool:
    """Returns True for a file with hosts in groups, or with hosts that have `ansible_` variables.

    Other files have sections too: unless its name says so, no line of an inventory is unknown.
    """
    is_named = posixpath.basename(path).startswith(("inventory", "hosts"))
    has_mark = "ansible_" in text or _SECTION.search(text) is not None
    if text.startswith("#!") or not (has_mark or is_named):
        return False
    read = ini_inventory("", text)
    if is_named and has_mark:
        return bool(read.hosts or read.unread)
    return bool(read.hosts) and ("ansible_" in text or not read.unread)


def ini_inventory(path: str, text: str) -> Inventory:
    """Returns the inventory of a file. A line outside of the format is in its ``unread``."""
    found = Inventory()
    group, kind = "ungrouped", "hosts"
    for number, written in enumerate(text.split("\n"), 1):
        line, place = written.strip(), Place(path, number)
        if not line or line[0] in "#;":
            continue
        if line.startswith("[") and (section := _SECTION.fullmatch(line)):
            group, kind = section[1].strip(), section[2] or "hosts"
            found.group(group)
        elif kind == "children":
            name = line.split("#")[0].strip()
            found.group(group).children[name] = None
            found.group(name)
        elif (
            problem := _variable(found, group, line, place)
            if kind == "vars"
            else _host(found, group, line, place)
        ):
            found.unread.append(Unread(place, problem))
    return found


def _variable(found: Inventory, group: str, line: str, place: Place) -> str:
    """Adds a line of a section of variables; says what is wrong with it."""
    key, equals, value = (part.strip() for part in line.partition("="))
    if not equals or not _WORD.fullmatch(key):
        return "it is no variable"
    if value[:1] in ("'", '"') and value.endswith(value[0]) and len(value) > 1:
        value = value[1:-1]
    found.group(group).variables[key] = Variable(value, place)
    return ""


def _host(found: Inventory, group: str, line: str, place: Place) -> str:
    if found.is_full or len(line) > _LONGEST:
        return "the inventory has too many hosts" if found.is_full else "the line is too long"
    try:
        pattern, *words = shlex.split(line, comments=True) if _SHELL.search(line) else line.split()
    except ValueError:
        return "its quotes do not match"
    if COMPUTED.search(pattern):
        return "a template computes the host's name"
    variables = {}
    for word in words:
        key, equals, value = word.partition("=")
        if not equals or not _WORD.fullmatch(key):
            return "it is no host with KEY=VALUE behind it"
        variables[key] = Variable(value, place)
    pattern, port = without_port(pattern)
    names = expanded(pattern)
    if isinstance(names, str):
        return names
    if port:
        variables.setdefault("ansible_port", Variable(port, place))
    return found.add_hosts(names, group, variables, place)
