"""Every value of a lab's file is in its draft, or its line is under `Not read`."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from swarmctl.importing.drafting import Kind, imported
from tests.importing.drafts import lab

# Attributes of each element, and the elements that may be in it.
_CONDITIONS = ("if", "unless")
ROS_1: Mapping[str, tuple[Sequence[str], Sequence[str]]] = {
    "launch": ((), ("arg", "param", "rosparam", "env", "remap", "machine", "node", "include", "group",
                    "test", "master")),
    "group": (("ns", "clear_params", *_CONDITIONS), ("param", "rosparam", "env", "remap", "node", "include")),
    "node": (("args", "ns", "machine", "respawn", "respawn_delay", "required", "output", "cwd",
              "launch-prefix", *_CONDITIONS), ("param", "rosparam", "env", "remap")),
    "include": (("ns", "clear_params", "pass_all_args", *_CONDITIONS), ("arg", "env")),
    "param": (("value", "type", "textfile", "command", *_CONDITIONS), ()),
    "rosparam": (("param", "ns", "file", "command", *_CONDITIONS), ()),
    "env": (_CONDITIONS, ()), "remap": (_CONDITIONS, ()), "arg": (("default", *_CONDITIONS), ()),
    "machine": (("user", "ssh-port", "default", "env-loader", "timeout"), ()),
    "test": (("args", "time-limit"), ()), "master": (("auto",), ()),
}  # fmt: skip
_OF_ROS_1 = {
    "node": ("pkg", "type", "name"), "include": ("file",), "param": ("name",), "env": ("name", "value"),
    "remap": ("from", "to"), "arg": ("name",), "machine": ("name", "address"),
    "test": ("pkg", "type", "test-name"),
}  # fmt: skip
ROS_2: Mapping[str, tuple[Sequence[str], Sequence[str]]] = {
    "launch": ((), ("arg", "let", "node", "include", "group", "executable", "set_env", "set_remap",
                    "set_parameter", "node_container", "load_composable_node", "timer", "unknown")),
    "group": (("scoped", *_CONDITIONS), ("push_ros_namespace", "node", "include", "let", "set_env",
                                         "set_parameter", "node_container", "set_remap")),
    "node": (("args", "namespace", "output", "respawn", "respawn_delay", "launch-prefix", "cwd", "name",
              "ros_args", *_CONDITIONS), ("param", "env", "remap")),
    "include": (_CONDITIONS, ("arg", "let")),
    "node_container": (("namespace", "args", "output", *_CONDITIONS), ("composable_node", "param", "env")),
    "load_composable_node": ((), ("composable_node",)),
    "composable_node": (("name", "namespace"), ("param", "remap", "extra_arg")),
    "timer": ((), ("node",)), "executable": (("cwd", "output"), ("env",)),
    "push_ros_namespace": (_CONDITIONS, ()), "param": (("type",), ()), "remap": ((), ()), "env": ((), ()),
    "extra_arg": ((), ()), "arg": (("default", "description"), ()), "let": (_CONDITIONS, ()),
    "set_env": (_CONDITIONS, ()), "set_remap": (_CONDITIONS, ()), "set_parameter": (_CONDITIONS, ()),
    "unknown": (("thing",), ()),
}  # fmt: skip
_OF_ROS_2 = {
    "node": ("pkg", "exec"), "include": ("file",), "param": ("name", "value"), "env": ("name", "value"),
    "remap": ("from", "to"), "arg": ("name",), "let": ("name", "value"), "executable": ("cmd",),
    "set_env": ("name", "value"), "set_remap": ("from", "to"), "set_parameter": ("name", "value"),
    "node_container": ("pkg", "exec", "name"), "composable_node": ("pkg", "plugin"),
    "load_composable_node": ("target",), "push_ros_namespace": ("namespace",), "timer": ("period",),
    "extra_arg": ("name", "value"),
}  # fmt: skip
# Values that decide something; any other value is a word of its own.
_VALUES: Mapping[str, Sequence[str]] = {
    **dict.fromkeys(_CONDITIONS, ("true", "false", "$(env VAGUE)")),
    **dict.fromkeys(("clear_params", "respawn", "required", "pass_all_args", "scoped"), ("true", "false")),
    "ssh-port": ("2222",), "output": ("screen",), "type": ("str", "int"), "timeout": ("9",),
    "period": ("2.0",), "respawn_delay": ("3",), "description": ("what it is",), "auto": ("start",),
}  # fmt: skip
_SILENT = {"true", "false", "str", "int", "screen", "what it is"}  # what decides, and what people read


PYTHON_NODE = "Node(package='p', executable='e', name='known'), "
# What each file has, as an element that only one ROS reads.
KNOWN = {
    Kind.LAUNCH: '<node pkg="p" type="e" name="known"/>',
    Kind.ROS_2: '<node pkg="p" exec="e" name="known"/>',
}
# Calls in Python: the arguments that each has and may have, where `A` is a word of its own, and calls within.
_NODE = ("name=A", "namespace=A", "output='screen'", "respawn=True", "respawn_delay=2.5", "prefix=A", "cwd=A",
         "parameters=[{A: A}]", "parameters=[{A: {A: [A, A]}}]", "remappings=[(A, A)]", "arguments=[A, A]",
         "env={A: A}", "additional_env={A: A}", "ros_arguments=[A]", "exec_name=A", "sigterm_timeout=A",
         "on_exit=A", "shell=True", "condition=C")  # fmt: skip
PYTHON: Mapping[str, tuple[str, Sequence[str], Sequence[str]]] = {
    "LaunchDescription": ("[{inside}]", (), (
        "Node", "LifecycleNode", "ComposableNodeContainer", "IncludeLaunchDescription", "GroupAction",
        "DeclareLaunchArgument", "SetLaunchConfiguration", "ExecuteProcess", "TimerAction", "SetParameter",
        "SetEnvironmentVariable", "SetRemap", "PushRosNamespace", "UnknownAction", "LoadComposableNodes",
    )),
    **dict.fromkeys(("Node", "LifecycleNode"), ("package=A, executable=A", _NODE, ())),
    "ComposableNodeContainer": (
        "name=A, namespace=A, package=A, executable=A, composable_node_descriptions=[{inside}]",
        ("output='screen'", "parameters=[{A: A}]", "condition=C"), ("ComposableNode",),
    ),
    "LoadComposableNodes": (
        "target_container=A, composable_node_descriptions=[{inside}]", ("condition=C",), ("ComposableNode",)
    ),
    "ComposableNode": (
        "package=A, plugin=A", ("name=A", "namespace=A", "parameters=[{A: A}]", "remappings=[(A, A)]",
                                "extra_arguments=[{A: True}]"), (),
    ),
    "IncludeLaunchDescription": (
        "PythonLaunchDescriptionSource(A)", ("launch_arguments={A: A}.items()", "condition=C"), ()
    ),
    "GroupAction": ("[{inside}]", ("launch_configurations={A: A}", "scoped=True", "condition=C"), (
        "Node", "PushRosNamespace", "IncludeLaunchDescription", "SetParameter", "SetRemap",
    )),
    "DeclareLaunchArgument": ("A", ("default_value=A", "choices=[A]"), ()),
    "SetLaunchConfiguration": ("A, A", ("condition=C",), ()),
    "ExecuteProcess": ("cmd=[A, A]", ("cwd=A", "output='screen'", "condition=C"), ()),
    "TimerAction": ("period=2.0, actions=[{inside}]", ("condition=C",), ("Node",)),
    "SetParameter": ("A, A", ("condition=C",), ()),
    "SetEnvironmentVariable": ("A, A", ("condition=C",), ()),
    "SetRemap": ("A, A", ("condition=C",), ()),
    "PushRosNamespace": ("A", ("condition=C",), ()),
    "UnknownAction": ("A", ("thing=A",), ()),
}  # fmt: skip
_CHOICES = ("IfCondition('true')", "IfCondition('false')", "UnlessCondition(EnvironmentVariable('VAGUE'))")
# What is left out with all that is in it.
_WHOLE = "(?:it is not started|a <|<unknown>|it runs|a container of|whether it applies)"


class Document:
    """A launch file, each element on a line of its own; ``values`` has the line of each."""

    root = "launch"

    def __init__(self, draw: Any, elements: Any, needed: Any) -> None:
        self.draw, self.elements, self.needed = draw, elements, needed
        self.lines: list[str] = []
        self.values: list[tuple[int, str]] = []
        self.above: list[int] = []  # lines of the elements around
        self.around: dict[int, tuple[int, ...]] = {}
        self.count = 0
        self.add(self.root, 0)

    def add(self, name: str, depth: int) -> None:
        optional, inside = self.elements[name]
        some = self.draw(st.lists(st.sampled_from(optional), max_size=3, unique=True)) if optional else []
        if set(some) >= set(_CONDITIONS):
            some.remove("unless")
        # `type` of ROS 1 is both what a node has to have and a kind of parameter
        keys = [*self.needed.get(name, ()), *(key for key in some if key not in self.needed.get(name, ()))]
        attributes = " ".join(f'{key}="{self.value(name, key)}"' for key in keys)
        children = self.draw(st.lists(st.sampled_from(inside), max_size=4)) if inside and depth < 4 else []
        self.lines.append(f"<{name} {attributes}>")
        self.around[len(self.lines)] = tuple(self.above)
        self.above.append(len(self.lines))
        for child in children:
            self.add(child, depth + 1)
        self.above.pop()
        self.lines.append(f"</{name}>")

    def value(self, name: str, key: str) -> str:
        choices = _VALUES.get(key) if (name, key) not in (("node", "type"), ("test", "type")) else None
        if choices:
            value = str(self.draw(st.sampled_from(choices)))
        else:
            self.count += 1
            value = f"word{self.count}x"
            if key in ("file", "textfile"):
                value = f"$(find pkg{value})/{value}.launch"
        if value not in _SILENT:
            self.values.append((len(self.lines) + 1, value))
        return value

    def text(self, first: str) -> str:
        """The document with an element in its first line."""
        return "\n".join((f"{self.lines[0]}{first}", *self.lines[1:])) + "\n"


class PythonDocument(Document):
    """The same of a launch file in Python, each call on a line of its own."""

    root = "LaunchDescription"

    def __init__(self, draw: Any) -> None:
        super().__init__(draw, PYTHON, {})

    def add(self, name: str, depth: int) -> None:
        needed, optional, inside = PYTHON[name]
        some = self.draw(st.lists(st.sampled_from(optional), max_size=3, unique_by=_key)) if optional else []
        children = self.draw(st.lists(st.sampled_from(inside), max_size=4)) if inside and depth < 4 else []
        text = ", ".join((needed, *some))
        while "A" in re.sub(r"[A-Za-z_]{2,}", "", text):
            text = re.sub(r"\bA\b", f"'{self.value(name, '')}'", text, count=1)
        text = re.sub(r"\bC\b", lambda _: str(self.draw(st.sampled_from(_CHOICES))), text)
        before, _, after = text.partition("{inside}")
        self.lines.append(f"{name}({before}")
        self.around[len(self.lines)] = tuple(self.above)
        self.above.append(len(self.lines))
        for child in children:
            self.add(child, depth + 1)
        self.above.pop()
        self.lines.append(f"{after})," if depth else f"{after})")

    def text(self, first: str) -> str:
        """The document with a call in its first line."""
        lines = [f"{self.lines[0]}{first}", *self.lines[1:]]
        return f"def generate_launch_description(): return {chr(10).join(lines)}\n"


def _key(argument: str) -> str:
    return argument.partition("=")[0].replace("additional_", "")


def vanished(name: str, document: Document, kind: Kind) -> list[str]:
    """The values that are neither in the draft nor on a line that is not read."""
    with tempfile.TemporaryDirectory() as folder:
        known = f"<launch>{KNOWN[kind]}</launch>"
        first = PYTHON_NODE if isinstance(document, PythonDocument) else KNOWN[kind]
        files = {
            name: document.text(first),
            f"known{'.launch' if kind is Kind.LAUNCH else '.launch.xml'}": known,
        }
        text = imported(lab(Path(folder), files), kind, Path("nowhere/swarm.yaml")).text
    lines = {int(one) for one in re.findall(rf"\b{re.escape(name)}:(\d+)", text)}
    whole = {int(one) for one in re.findall(rf"#   {re.escape(name)}:(\d+): {_WHOLE}", text)}
    found: list[str] = []
    for line, value in document.values:
        if whole & {*document.around[line]}:
            continue
        words = re.findall(r"word\d+x", value) or [value]
        if line not in lines and not any(word in text for word in words):
            found.append(f"line {line}: {value}")
    return found


@pytest.mark.parametrize(
    ("name", "elements", "needed", "kind"),
    [
        ("a.launch", ROS_1, _OF_ROS_1, Kind.LAUNCH),
        ("a.launch.xml", ROS_2, _OF_ROS_2, Kind.ROS_2),
    ],
)
@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_no_value_of_an_element_vanishes(
    name: str, elements: Any, needed: Any, kind: Kind, data: Any
) -> None:
    document = Document(data.draw, elements, needed)
    assert vanished(name, document, kind) == [], document.text("")


@settings(deadline=None, max_examples=60)
@given(data=st.data())
def test_no_value_of_a_call_vanishes(data: Any) -> None:
    document = PythonDocument(data.draw)
    assert vanished("a.launch.py", document, Kind.ROS_2) == [], document.text("")
