"""The actions, substitutions and conditions of launch, launch_ros and nav2_common, as Python calls them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from swarmctl.ros_packages.launch_values import (
    Action,
    Computed,
    Condition,
    Rewritten,
    Text,
    Unknown,
    Variable,
)
from swarmctl.ros_packages.python_values import FOLDER, LARGEST, between, joined


@dataclass
class Description:
    """A LaunchDescription, to which actions can be added."""

    actions: list[Any] = field(default_factory=list)


@dataclass(frozen=True)
class LaunchSource:
    """The file of an IncludeLaunchDescription."""

    file: Any


@dataclass(frozen=True)
class Component:
    """A ComposableNode, which is no action of its own."""

    action: Action


def started(value: Any) -> list[Action] | None:
    """Returns the actions of a value, also within lists and descriptions; None if it has anything else."""
    waiting, found = [value], list[Action]()
    for _ in range(LARGEST):
        if not waiting:
            return found
        one = waiting.pop(0)
        if isinstance(one, Action):
            found.append(one)
        elif isinstance(one, (list, tuple, Description)):
            waiting[:0] = one.actions if isinstance(one, Description) else one
        else:
            return None
    return None


def uncertain(value: Any, why: str) -> Any:
    """Returns what a value is if it is only perhaps, for a reason."""
    if not why:
        return value
    if isinstance(value, dict):
        return {key: Unknown(why) for key in value}
    actions = started(value)
    if value is None or actions is None:
        return value if isinstance(value, Unknown) or value is None else Unknown(why)
    perhaps = Condition(Unknown(why))
    if isinstance(value, Action) and value.condition is None:
        return replace(value, condition=perhaps)
    line = actions[0].line if actions else 0
    made = Action(
        "group", line, {"actions": actions, "scoped": False}, perhaps
    )  # what one sets, the next has
    return (
        made
        if isinstance(value, Action)
        else Description([made])
        if isinstance(value, Description)
        else [made]
    )


def listed(value: Any) -> list[Any]:
    """Returns what an argument that takes a list or one item has."""
    return list(value) if isinstance(value, tuple) else [] if value is None else [value]


def argument_of(given: Sequence[Any], named: Mapping[str, Any], number: int, name: str) -> Any:
    """Returns an argument that is given by its place or by its name; None if it is not."""
    return given[number] if len(given) > number else named.get(name)


def _variable(given: Sequence[Any], named: Mapping[str, Any]) -> Any:
    name = argument_of(given, named, 0, "variable_name")
    return (
        Variable(name, named.get("default")) if isinstance(name, str) else Unknown("a name that it computes")
    )


def _path(given: Sequence[Any], named: Mapping[str, Any]) -> Any:
    parts = argument_of(given, named, 0, "substitutions")
    parts = parts if isinstance(parts, (list, tuple)) else []
    parts = [Text(tuple(one)) if isinstance(one, (list, tuple)) else one for one in parts]
    return joined(between("/", parts))


def share_of(given: Sequence[Any], named: Mapping[str, Any]) -> Any:
    """Returns the substitution for the share folder of a package."""
    package = argument_of(given, named, 0, "package")
    package = package[0] if isinstance(package, (list, tuple)) and len(package) == 1 else package
    if isinstance(package, (Text, Variable)):
        return Text(("$(find-pkg-share ", package, ")"))
    return f"$(find-pkg-share {package})" if isinstance(package, str) else Unknown("a package")


def _environment(given: Sequence[Any], named: Mapping[str, Any]) -> Any:
    default = named.get("default_value", given[1] if len(given) > 1 else None)
    shown = f", by default `{default}`" if isinstance(default, str) else ""
    return Unknown(f"$(env {argument_of(given, named, 0, 'name')}){shown}")


def _printed(command: str) -> Unknown:
    """What a command prints, which only the host knows."""
    return Unknown(f"what `{command[:100]}` prints")


def _rewritten(given: Sequence[Any], named: Mapping[str, Any]) -> Any:
    rewrites = argument_of(given, named, 1, "param_rewrites")
    known = (
        {key: one for key, one in rewrites.items() if isinstance(key, str)}
        if isinstance(rewrites, dict)
        else {}
    )
    return Rewritten(argument_of(given, named, 0, "source_file"), known, named.get("root_key") or "")


def _replaced(given: Sequence[Any], named: Mapping[str, Any]) -> Any:
    """The ReplaceString of Nav2: texts in the values of a file of parameters."""
    found = argument_of(given, named, 1, "replacements")
    pairs = [part for pair in found.items() for part in pair] if isinstance(found, dict) else []
    when = argument_of(given, named, 2, "condition")
    wanted = when.value if isinstance(when, Condition) else True
    wanted = wanted if not isinstance(when, Condition) or when.wanted else Computed("not", (wanted,))
    return Computed("replace", (argument_of(given, named, 0, "source_file"), wanted, *pairs))


def parts_of(value: Any) -> tuple[Any, ...]:
    """Returns the parts of a text that is given as a list, or as one."""
    return tuple(value) if isinstance(value, (list, tuple)) else (value,)


def _two(given: Sequence[Any], named: Mapping[str, Any]) -> tuple[Any, Any]:
    return argument_of(given, named, 0, "left"), argument_of(given, named, 1, "right")


def _first(given: Sequence[Any], named: Mapping[str, Any]) -> Any:
    """The value that a wrapper such as ParameterValue has."""
    return given[0] if given else next(iter(named.values()), None)


SUBSTITUTIONS: Mapping[str, Callable[[Sequence[Any], Mapping[str, Any]], Any]] = {
    "LaunchConfiguration": _variable,
    "PathJoinSubstitution": _path,
    "FindPackageShare": share_of,
    "FindPackagePrefix": share_of,
    "EnvironmentVariable": _environment,
    "TextSubstitution": lambda given, named: Text((_first(given, named),)),
    "ParameterValue": _first,
    "ParameterFile": _first,
    "StringJoinSubstitution": lambda given, named: joined(
        between(str(named.get("delimiter", "")), given[0] if given and isinstance(given[0], list) else [])
    ),
    "FindExecutable": _first,
    "ThisLaunchFileDir": lambda _given, _named: FOLDER,
    "Command": lambda given, named: Computed(_printed, parts_of(argument_of(given, named, 0, "command"))),
    "AnonName": lambda _given, _named: Unknown("$(anon)"),
    "NotSubstitution": lambda given, named: Computed("not", (argument_of(given, named, 0, "value"),)),
    "AndSubstitution": lambda given, named: Computed("and", _two(given, named)),
    "OrSubstitution": lambda given, named: Computed("or", _two(given, named)),
    "EqualsSubstitution": lambda given, named: Computed("equals", _two(given, named)),
    "NotEqualsSubstitution": lambda given, named: Computed("not", (Computed("equals", _two(given, named)),)),
    "IfElseSubstitution": lambda given, named: (
        Computed(
            "if",
            (given[0], argument_of(given, named, 1, "if_value"), argument_of(given, named, 2, "else_value")),
        )
        if given
        else Unknown("$(if)")
    ),
    "RewrittenYaml": _rewritten,
    "ReplaceString": _replaced,
    "HasNodeParams": lambda given, named: Computed(
        "has", (argument_of(given, named, 0, "source_file"), argument_of(given, named, 1, "node_name"))
    ),
}

CONDITIONS = {
    "IfCondition": True, "UnlessCondition": False,
    "LaunchConfigurationEquals": True, "LaunchConfigurationNotEquals": False,
}  # fmt: skip

SOURCES = frozenset(
    ("PythonLaunchDescriptionSource", "AnyLaunchDescriptionSource", "XMLLaunchDescriptionSource",
     "YAMLLaunchDescriptionSource", "FrontendLaunchDescriptionSource", "LaunchDescriptionSource")
)  # fmt: skip

_Arguments = Mapping[str, Any]


def _of_node(given: Sequence[Any], named: _Arguments) -> _Arguments:
    own = dict(named)
    for old, new in (
        ("node_executable", "executable"),
        ("node_name", "name"),
        ("node_namespace", "namespace"),
    ):
        own.setdefault(new, named.get(old))
    own["components"] = _components(named.get("composable_node_descriptions"))
    return own


def _components(value: Any) -> list[Any]:
    return [one.action for one in value if isinstance(one, Component)] if isinstance(value, list) else []


def _of_argument(given: Sequence[Any], named: _Arguments) -> _Arguments:
    return {"name": argument_of(given, named, 0, "name"), "default": named.get("default_value")}


def _of_pair(given: Sequence[Any], named: _Arguments) -> _Arguments:
    return {
        "name": argument_of(given, named, 0, "name"),
        "value": argument_of(given, named, 1, "value"),
        "from": argument_of(given, named, 0, "src"),
        "to": argument_of(given, named, 1, "dst"),
    }


def _of_group(given: Sequence[Any], named: _Arguments) -> _Arguments:
    return {
        "actions": argument_of(given, named, 0, "actions") or [],
        "scoped": named.get("scoped", True),
        "values": named.get("launch_configurations"),
    }


def _of_include(given: Sequence[Any], named: _Arguments) -> _Arguments:
    source = argument_of(given, named, 0, "launch_description_source")
    file = source.file if isinstance(source, LaunchSource) else source
    file = Text(tuple(file)) if isinstance(file, (list, tuple)) else file
    return {"file": file, "arguments": named.get("launch_arguments")}


def _of_timer(given: Sequence[Any], named: _Arguments) -> _Arguments:
    actions = named.get("actions") or (given[1] if len(given) > 1 else [])
    return {"actions": actions, "period": argument_of(given, named, 0, "period")}


def _of_process(_given: Sequence[Any], named: _Arguments) -> _Arguments:
    return named


def _of_event(given: Sequence[Any], named: _Arguments) -> _Arguments:
    return {
        "what": "an event handler has no key in a spec",
        "actions": [*_actions_in((*given, *(one for key, one in named.items() if key != "target_action")))],
    }


def _actions_in(values: Sequence[Any]) -> Iterator[Action]:
    waiting = [*values]
    for _ in range(LARGEST):
        if not waiting:
            return
        one = waiting.pop(0)
        if isinstance(one, (list, tuple)):
            waiting[:0] = one
        elif isinstance(one, Action) and one.kind == "later":
            waiting[:0] = one.arguments.get("actions", ())
        elif isinstance(one, Action):
            yield one


ACTIONS: Mapping[str, tuple[str, Callable[[Sequence[Any], _Arguments], _Arguments]]] = {
    **dict.fromkeys(("Node", "LifecycleNode"), ("node", _of_node)),
    "ComposableNodeContainer": ("container", _of_node),
    "LoadComposableNodes": ("load", _of_node),
    "ComposableNode": ("component", _of_node),
    "DeclareLaunchArgument": ("arg", _of_argument),
    "SetLaunchConfiguration": ("let", _of_pair),
    "UnsetLaunchConfiguration": ("unset", _of_pair),
    "GroupAction": ("group", _of_group),
    **dict.fromkeys(
        ("PushRosNamespace", "PushROSNamespace"),
        ("namespace", lambda given, named: {"namespace": argument_of(given, named, 0, "namespace")}),
    ),
    "IncludeLaunchDescription": ("include", _of_include),
    "SetRemap": ("remap", _of_pair),
    "SetParameter": ("parameter", _of_pair),
    **dict.fromkeys(("SetEnvironmentVariable", "AppendEnvironmentVariable"), ("environment", _of_pair)),
    "TimerAction": ("children", _of_timer),
    **dict.fromkeys(
        ("LogInfo", "PushLaunchConfigurations", "PopLaunchConfigurations", "ResetLaunchConfigurations"),
        ("silent", lambda _given, _named: {}),
    ),
    **dict.fromkeys(("ExecuteProcess", "ExecuteLocal"), ("process", _of_process)),
    **dict.fromkeys(
        ("RegisterEventHandler", "OnProcessExit", "OnProcessStart", "OnShutdown", "OnStateTransition",
         "OnExecutionComplete", "OnProcessIO", "EmitEvent", "Shutdown"),
        ("later", _of_event),
    ),
}  # fmt: skip


def condition_of(named: Mapping[str, Any]) -> Condition | None:
    """Returns the condition of an action; None if it has none."""
    found = named.get("condition")
    if found is None or isinstance(found, Condition):
        return found
    return Condition(found if isinstance(found, Unknown) else Unknown("a condition that it computes"))


def action_of(name: str, given: Sequence[Any], named: _Arguments, line: int) -> Any:
    """Returns the action, or the component, that a call of one of ``ACTIONS`` makes."""
    kind, arguments = ACTIONS[name]
    made = Action(kind, line, arguments(given, named), condition_of(named))
    return Component(made) if kind == "component" else made
