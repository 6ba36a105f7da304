"""The shell commands of files that are no shell script: units of systemd and Dockerfiles.

Source: systemd.service(5), systemd.exec(5); docs.docker.com, "Dockerfile reference".
"""

from __future__ import annotations

import json
import posixpath
import re
import shlex

UNIT = ".service"
_IMAGE = re.compile(r"(?:^|[.-])(?:dockerfile|containerfile)(?:$|[.-])", re.IGNORECASE)
_LINE = re.compile(r"(?:\\\n|[^\n])+")  # with those that continue it
_OF_UNIT = re.compile(
    r"\s*(Environment|EnvironmentFile|ExecStart|ExecStartPre|ExecStartPost)\s*=(.*)", re.DOTALL
)
_OF_IMAGE = re.compile(r"\s*(ENV|CMD|ENTRYPOINT)\s+(.*)", re.DOTALL | re.IGNORECASE)
_OF_ROS = re.compile(r"(ROS|RMW|CYCLONEDDS|FASTRTPS|FASTDDS|ZENOH)_")
_PREFIXES = "-@:+!"  # of a command of a unit, or of its file of variables


def is_image(path: str) -> bool:
    """Returns True for a Dockerfile, by its name."""
    return bool(_IMAGE.search(posixpath.basename(path)))


def script_text(path: str, text: str) -> str:
    """Returns what a file does as a shell script, in which each command begins in its line of the file."""
    commands = _of_image if is_image(path) else _of_unit if path.endswith(UNIT) else None
    if commands is None:
        return text

    def within(line: re.Match[str]) -> str:
        found = commands(line[0])
        return found + "\n" * (line[0].count("\n") - found.count("\n"))

    return _LINE.sub(within, text)


def _of_unit(line: str) -> str:
    match = _OF_UNIT.fullmatch(line)
    if match is None:
        return ""
    value = match[2].strip().lstrip(_PREFIXES)
    if match[1] == "Environment":
        return " ".join(("export", *_pairs(value)))
    return f"source {value}" if match[1] == "EnvironmentFile" else value


def _of_image(line: str) -> str:
    match = _OF_IMAGE.fullmatch(line)
    if match is None:
        return ""
    if match[1].upper() == "ENV":
        name, _, value = match[2].strip().partition(" ")
        pairs = _pairs(match[2] if "=" in name else f"{name}={shlex.quote(value.strip())}")
        of_ros = [one for one in pairs if _OF_ROS.match(one)]
        others = [f"ENV {one.partition('=')[0]}" for one in pairs if not _OF_ROS.match(one)]  # no value
        return "; ".join((*([f"export {' '.join(of_ros)}"] if of_ros else []), *others))
    try:
        words = json.loads(match[2])
    except (ValueError, RecursionError):
        return line  # in the form of a shell
    return f"{match[1]} {shlex.join(map(str, words))}" if isinstance(words, list) else line


def _pairs(text: str) -> list[str]:
    """Each `NAME=VALUE` of a text, quoted for a shell."""
    try:
        pairs = [word.partition("=") for word in shlex.split(text.replace("\\\n", " "))]
    except ValueError:
        return []
    return [f"{name}={shlex.quote(value)}" for name, _, value in pairs]
