#!/usr/bin/env python3
"""Stands in for the command `ros2` on a lab host: ``ros2 launch FILE``, a file of a driver from swarmctl.

It becomes the stand-in of the driver, with the names and the environment of that file. It runs no launch file
of a package.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from xml.etree import ElementTree

NODE = "/usr/share/swarm_stand_in/stand_in.py"
INCLUDED = re.compile(r"\$\(find-pkg-share ([^)]+)\)/(.+)")
NAMESPACE = re.compile(r"^namespace argument: (.+)$", re.MULTILINE)
USAGE = "a lab has no ros2 command; what stands in for it runs `ros2 launch` of a driver's file from swarmctl"


def node_words(file: Path, prefixes: Sequence[str], environment: dict[str, str]) -> Iterator[str]:
    """Yields the arguments of the stand-in, and adds to ``environment``.

    Raises ``ValueError`` for a file that swarmctl has not written for a driver with a stand-in.
    """
    launch = ElementTree.parse(file).getroot()
    group = launch.find("group")
    if len(launch) != 1 or group is None:
        raise ValueError(f"{file} does not start one driver")
    for action in group:
        value = action.attrib
        if action.tag == "push_ros_namespace":
            yield from ("-r", f"__ns:=/{value['namespace']}")
        elif action.tag == "set_remap":
            yield from ("-r", f"{value['from']}:={value['to']}")
        elif action.tag == "set_env":
            environment[value["name"]] = value["value"]
        elif action.tag == "include":
            taking = NAMESPACE.search(included(value["file"], prefixes))
            spaces = [one.get("value") for one in action if taking and one.get("name") == taking[1]]
            yield from (word for space in spaces for word in ("-r", f"__ns:=/{space}"))
        else:
            raise ValueError(f"{file} has a <{action.tag}>")


def included(name: str, prefixes: Sequence[str]) -> str:
    """Returns the text of a launch file that a stand-in replaces. Raises ``ValueError`` for another."""
    found = INCLUDED.fullmatch(name)
    places = [Path(prefix, "share", *found.groups()) for prefix in prefixes] if found else []
    file = next((one for one in places if one.is_file()), None)
    if file is None:
        raise ValueError(f"there is no {name} in {os.pathsep.join(prefixes)}")
    text = file.read_text("utf-8")
    if "swarm_stand_in" not in text:
        raise ValueError(f"{file} has no stand-in")
    return text


def main(words: Sequence[str]) -> str:
    """Becomes the stand-in, or returns what is wrong."""
    if len(words) != 2 or words[0] != "launch":
        return USAGE
    prefixes = [one for one in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if one]
    environment = dict(os.environ)
    try:
        arguments = list(node_words(Path(words[1]), prefixes, environment))
    except (OSError, ValueError, KeyError, ElementTree.ParseError) as error:
        return f"{words[1]}: {error}; {USAGE}"
    return os.execve(NODE, [NODE, "--ros-args", *arguments], environment)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
