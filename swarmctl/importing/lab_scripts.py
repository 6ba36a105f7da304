"""What the scripts of a lab set and start, on each of its computers."""

from __future__ import annotations

import posixpath
import re
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

from swarmctl.importing.command_lines import Word
from swarmctl.importing.draft import Value
from swarmctl.importing.shell_script import Assignment, Command, Remote, Script
from swarmctl.importing.unknown_values import is_secret
from swarmctl.ros_packages.launch_files import Include, Launched, Node, Place, Setting
from swarmctl.ros_packages.launch_values import Unknown
from swarmctl.ros_packages.package import Package

#: The variables that say which master and which address a node of ROS 1 uses.
OF_ROS_1 = ("ROS_MASTER_URI", "ROS_IP", "ROS_HOSTNAME")
#: The variables by which nodes of ROS 2 find each other.
OF_ROS_2 = (
    "ROS_DOMAIN_ID", "RMW_IMPLEMENTATION", "ROS_DISCOVERY_SERVER", "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_STATIC_PEERS", "ROS_LOCALHOST_ONLY", "ROS_SUPER_CLIENT", "CYCLONEDDS_URI",
    "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE", "ZENOH_SESSION_CONFIG_URI",
    "ZENOH_ROUTER_CONFIG_URI",
)  # fmt: skip
_PROGRAMS_1 = {"roslaunch", "rosrun", "roscore", "rosservice", "rostopic", "rosparam"}
_PROGRAMS_2 = {"ros2", "fastdds", "fast-discovery-server", "MicroXRCEAgent", "micro_ros_agent"}
_SOURCED_1 = re.compile(r"/opt/ros/(noetic|melodic|kinetic|indigo)/")
_SOURCED_2 = re.compile(r"/opt/ros/(?!noetic|melodic|kinetic|indigo)\w+/")
_QUIET = {  # that neither start nor configure a node
    "", "cd", "source", ".", "echo", "printf", "sleep", "wait", "set", "exit", "true", "clear", "read",
    "trap", "mkdir", "shopt", "roscore", "test", "[", "return", "shift", "date", "pwd", "ls", "logout",
}  # fmt: skip
_LAUNCH_VALUES = ("--launch-prefix", "--launch-prefix-filter", "-p", "--port", "-w", "--num_workers", "-t",
                  "--timeout", "--pid")  # fmt: skip
_ARGUMENT = re.compile(r"([\w-]+):=(.*)", re.DOTALL)
_OF_THE_SHELL = {"PATH", "PYTHONPATH", "LD_LIBRARY_PATH", "DISPLAY", "PYTHONUNBUFFERED", "HOME", "USER"}

#: Evaluates a launch file of a package with arguments in a namespace, up to a number of actions; None for the
#: driver of a robot type.
Evaluate = Callable[[Package, str, Mapping[str, str | None], str, int], Launched | None]


class Ros(Enum):
    """Of which ROS a script is."""

    ONE = 1
    TWO = 2
    EITHER = 0


@dataclass
class Started:
    """What one script sets and starts on one computer: ``remote``, or where the script runs."""

    path: str
    remote: Remote | None
    place: Place
    variables: dict[str, Value] = field(default_factory=dict)
    launched: Launched = field(default_factory=Launched)
    servers: dict[int, Place] = field(default_factory=dict)  # of discovery, by their numbers
    unread: dict[str, None] = field(default_factory=dict)
    name: str = ""  # of a service
    runs_others: bool = False  # programs that start no node

    @property
    def key(self) -> str:
        """The path of the script, with the computer if it is another one, or with the service."""
        if self.remote:
            return f"{self.path} on {self.remote.address}"
        return f"{self.path}: {self.name}" if self.name else self.path


def ros_of(script: Script) -> Ros | None:
    """Returns of which ROS a script is; None if it has nothing to do with any."""
    is_remote = False
    for one in script.steps:
        is_remote = is_remote or one.remote is not None
        words = (one.name,) if isinstance(one, Assignment) else one.words
        for word in words:
            if not isinstance(word, str):
                continue
            if word in OF_ROS_1 or word in _PROGRAMS_1 or _SOURCED_1.search(word):
                return Ros.ONE
            if word in OF_ROS_2 or word in _PROGRAMS_2 or _SOURCED_2.search(word):
                return Ros.TWO
    return Ros.EITHER if is_remote else None


def started_by(
    path: str,
    script: Script,
    packages: Mapping[str, Package],
    whole: Package,
    evaluate: Evaluate,
    *,
    limit: int,
) -> Sequence[Started]:
    """Returns what a script sets and starts, by computer; ``whole`` has the files of the lab's folder."""
    found: dict[Remote | None, Started] = {}
    left = limit

    def within(
        package: Package, file: str, given: Mapping[str, str | None], namespace: str
    ) -> Launched | None:
        nonlocal left
        one = evaluate(package, file, given, namespace, left)
        left -= one.cost if one else 0
        return one

    if not script.is_whole:
        here = found[None] = Started(path, None, Place(path, 0))
        here.unread[f"{path}: it has more steps, or more within each other, than are read"] = None
    for one in script.steps:
        here = found.setdefault(one.remote, Started(path, one.remote, one.place))
        here.launched.files[here.key] = None
        if isinstance(one, Assignment):
            _set(here, one)
        else:
            _Reader(here, one, packages, whole, within).read()
    return list(found.values())


def _set(here: Started, one: Assignment) -> None:
    """Adds a variable of ROS, or why it is not known."""
    if one.name not in (*OF_ROS_1, *OF_ROS_2):
        return
    before = here.variables.get(one.name)
    if before is not None and before.value != one.value:
        shown = "" if is_secret(one.name, str(before.value)) else f" to {before.value}"
        here.unread[f"{before.place}: {one.name} is set{shown}, and again in line {one.place.line}"] = None
    if isinstance(one.value, Unknown):
        here.variables.pop(one.name, None)
        shown = f": {one.value.why}" if "`" in one.value.why and not is_secret("", one.value.why) else ""
        what = one.value.why if one.value.why == "a template" else f"the shell{shown}"
        here.unread[f"{one.place}: {one.name} is computed by {what}"] = None
    elif before is not None and before.value != one.value:
        del here.variables[one.name]
        shown = "" if is_secret(one.name, one.value) else f", here to {one.value}"
        here.unread[f"{one.place}: {one.name} is set more than once in this file{shown}"] = None
    elif one.value and not any(f": {one.name} is " in why for why in here.unread):
        here.variables[one.name] = Value(one.value, one.place)


class _Reader:
    """Reads one command as what ROS starts."""

    def __init__(
        self,
        here: Started,
        command: Command,
        packages: Mapping[str, Package],
        whole: Package,
        evaluate: Callable[[Package, str, Mapping[str, str | None], str], Launched | None],
    ) -> None:
        self.here, self.command, self.packages, self.whole = here, command, packages, whole
        self.evaluate = evaluate
        self.words = command.words
        self.place = command.place

    def read(self) -> None:
        program = posixpath.basename(self.words[0]) if isinstance(self.words[0], str) else "..."
        second = self.words[1] if len(self.words) > 1 else ""
        if program == "ssh" and len(self.words) == 1:
            return
        if program == "roslaunch" or (program, second) == ("ros2", "launch"):
            self.launch(self.words[1 if program == "roslaunch" else 2 :])
        elif program == "rosrun" or (program, second) == ("ros2", "run"):
            self.run(self.words[1 if program == "rosrun" else 2 :])
        elif program == "MicroXRCEAgent" or self.words[:3] == ("ros2", "bag", "record"):
            self.process()
        elif (program, second) == ("fastdds", "discovery") or program == "fast-discovery-server":
            self.server()
        elif program == "ENV":  # of a Dockerfile
            self.not_read("is of the image, and stays in it")
        elif program in ("CMD", "ENTRYPOINT"):
            self.not_read("is what a container of this image runs")
        elif program not in _QUIET:
            self.here.runs_others = True
            if self.command.remote is not None or self.is_of_ros(program):
                self.not_read("is no launch file and no node")

    def is_of_ros(self, program: str) -> bool:
        return program in ("ssh", "python", "python3") or any(
            one in text.split()
            for one in _PROGRAMS_1 | _PROGRAMS_2
            for text in self.words
            if isinstance(text, str)
        )

    def not_read(self, why: str) -> None:
        shown = " ".join(one if isinstance(one, str) else "..." for one in self.words)[:100]
        unknown = next(
            (
                f" depends on {'what may be a secret' if is_secret(one.why, one.why) else one.why}"
                for one in self.words
                if isinstance(one, Unknown)
            ),
            "",
        )
        texts = [word if isinstance(word, str) else word.why for word in self.words]
        secret = any(is_secret(text.partition("=")[0], text) for text in texts)
        what = "a command that may have a secret" if secret else f"`{shown}`"
        self.here.unread[f"{self.place}: {what} {unknown.strip() or why}"] = None

    def launch(self, words: Sequence[Word]) -> None:
        """`roslaunch PACKAGE FILE NAME:=VALUE` or `ros2 launch FILE NAME:=VALUE`."""
        rest = list(_without_options(words))
        arguments: dict[str, str | None] = {}
        names: list[str] = []
        for word in rest:
            text = word.before if isinstance(word, Unknown) else word
            match = _ARGUMENT.fullmatch(text)
            if match and isinstance(word, Unknown):
                arguments[match[1]] = None
                self.here.launched.unknown[self.place, f"argument {match[1]}"] = word.why
            elif match:
                arguments[match[1]] = match[2]
            elif isinstance(word, Unknown):
                self.not_read("")
                return
            else:
                names.append(text)
        if not names:
            self.not_read("names no launch file")
            return
        files = names[1:] if len(names) > 1 and not _is_path(names[0]) else names
        package = names[0] if files is not names else ""
        for file in files:
            self.file(package, file, arguments)

    def file(self, package: str, file: str, arguments: Mapping[str, str | None]) -> None:
        namespace = self.namespace()
        found, path = self.found(package, file)
        if self.command.certain and found is not None:
            launched = self.evaluate(found, path, arguments, namespace)
            if launched is not None:
                self.here.launched.add(launched)
                return
        environment = tuple(self.environment())
        if not self.command.certain:
            self.here.launched.unknown.setdefault((self.place, "if"), "a branch or a loop of the script")
        path = file if package else posixpath.normpath(file)
        one = Include(package, path, namespace, arguments, self.place, self.command.certain, environment)
        self.here.launched.includes.append(one)

    def found(self, package: str, file: str) -> tuple[Package | None, str]:
        """The package that has a launch file, and its path there; None if it is not here."""
        if package:
            one = self.packages.get(package)
            paths = [path for path in one.contents if posixpath.basename(path) == file] if one else []
            return (one, min(paths, key=len)) if paths else (None, "")
        beside = posixpath.normpath(posixpath.join(posixpath.dirname(self.here.path), file))
        ends = [one for one in self.whole.contents if one == beside or file.endswith(f"/{one}")]
        return (self.whole, ends[0]) if ends else (None, "")

    def namespace(self) -> str:
        """The namespace that the variable of ROS 1 sets."""
        value = self.command.environment.get("ROS_NAMESPACE", "") if self.words[0] != "ros2" else ""
        return "" if isinstance(value, Unknown) else value.strip("/")

    def environment(self) -> Iterator[Setting]:
        """The variables that a program needs: not those that say which nodes it finds."""
        for name, value in self.command.environment.items():
            if name not in (*OF_ROS_1, *OF_ROS_2, "ROS_NAMESPACE", *_OF_THE_SHELL):
                yield Setting(name, None if isinstance(value, Unknown) else value, self.place)

    def run(self, words: Sequence[Word]) -> None:
        """`rosrun PACKAGE EXECUTABLE` or `ros2 run PACKAGE EXECUTABLE`, with what follows."""
        package, executable, *rest = [*_without_options(words), "", ""]
        if not (isinstance(package, str) and isinstance(executable, str) and package and executable):
            self.not_read("names no node")
            return
        if (package, executable) == ("rmw_zenoh_cpp", "rmw_zenohd"):
            self.here.servers.setdefault(len(self.here.servers), self.place)
            return
        own = _Own(rest[:-2] if rest[-2:] == ["", ""] else rest)
        own.read()
        if own.unknown:
            self.not_read("")
            self.here.launched.unknown.setdefault((self.place, "args"), own.unknown)
        for why in own.left:
            shown = "an argument that may be a secret" if is_secret(why, why) else why
            self.here.unread[f"{self.place}: {shown}"] = None
        namespace = own.namespace or self.namespace()
        name = own.name or executable
        if not self.command.certain:
            self.here.launched.unknown.setdefault((self.place, "if"), "a branch or a loop of the script")
        self.here.launched.nodes.append(
            Node(
                f"/{namespace}/{name}" if namespace else f"/{name}",
                package,
                executable,
                tuple(own.remaps),
                self.place,
                self.command.certain,
                arguments=None if own.unknown else shlex.join(own.words),
                parameters=tuple(Setting(*one, self.place) for one in own.parameters),
                environment=tuple(self.environment()),
                has_name=bool(own.name),
            )
        )

    def process(self) -> None:
        """A command that runs on, and is no node."""
        words = [one for one in self.words if isinstance(one, str)]
        if len(words) < len(self.words):
            self.not_read("")
            return
        if not self.command.certain:
            self.here.launched.unknown.setdefault((self.place, "if"), "a branch or a loop of the script")
        name = "rosbag" if words[0] == "ros2" else posixpath.basename(words[0])
        self.here.launched.nodes.append(
            Node(
                f"/{name}",
                "",
                words[0],
                (),
                self.place,
                self.command.certain,
                arguments=shlex.join(words[1:]),
                environment=tuple(self.environment()),
            )
        )

    def server(self) -> None:
        """`fastdds discovery -i 0 -l ADDRESS -p PORT`."""
        words = [one if isinstance(one, str) else "" for one in self.words]
        for flag in ("-i", "--server-id"):
            if flag in words[:-1] and words[words.index(flag) + 1].isdecimal():
                self.here.servers[int(words[words.index(flag) + 1][:6])] = self.place
                return
        self.here.servers.setdefault(len(self.here.servers), self.place)


class _Own:
    """The arguments of a node: its own words, and what `--ros-args` or `NAME:=VALUE` set."""

    def __init__(self, words: Sequence[Word]) -> None:
        self.unknown = next((one.why for one in words if isinstance(one, Unknown)), "")
        self.given = [one for one in words if isinstance(one, str)]
        self.words: list[str] = []
        self.remaps: list[tuple[str, str]] = []
        self.parameters: list[tuple[str, str]] = []
        self.namespace = self.name = ""
        self.left: list[str] = []

    def read(self) -> None:
        is_of_ros, given = False, iter(self.given)
        for word in given:
            if word in ("--ros-args", "--"):
                is_of_ros = word == "--ros-args"
            elif not is_of_ros:
                self.rule(word, self.words.append)
            elif word in ("-r", "--remap", "-p", "--param"):
                value = next(given, "")
                self.rule(value if word in ("-r", "--remap") else f"_{value}", self.left.append)
            elif word in ("--params-file", "--log-level", "-e", "--enclave", "--log-config-file"):
                self.left.append(f"{word} {next(given, '')} has no key in a spec; write `params` or `args`")
            else:
                self.left.append(f"{word} has no key in a spec")

    def rule(self, word: str, other: Callable[[str], None]) -> None:
        """One `NAME:=VALUE`: a remapping, or by the underscores before it a parameter, name or namespace."""
        name, is_rule, value = word.partition(":=")
        if not is_rule:
            other(word) if word else None
        elif name == "__ns":
            self.namespace = value.strip("/")
        elif name in ("__node", "__name"):
            self.name = value
        elif name.startswith("_") and not name.startswith("__"):
            self.parameters.append((name[1:], value))
        elif name.startswith("__"):
            self.left.append(f"{word} has no key in a spec")
        else:
            self.remaps.append((name, value))


def _without_options(words: Sequence[Word]) -> Iterator[Word]:
    """The words but the options before the first other one."""
    rest = list(words)
    while rest and isinstance(rest[0], str) and rest[0].startswith("-"):
        if rest.pop(0) in _LAUNCH_VALUES and rest:
            rest.pop(0)
    yield from rest


def _is_path(text: str) -> bool:
    return "/" in text or text.endswith((".launch", ".xml", ".py", ".yaml", ".yml"))
