"""What a ROS program is started with, and what it declares: topics, services, placeholders in arguments."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from swarmctl.field_types import (
    ConsistencyError,
    EnvironmentKey,
    FileName,
    GraphName,
    LaunchFile,
    Model,
    PackageName,
    Parameter,
    Printable,
    TypeName,
    Value,
)
from swarmctl.links.link_base import RobotLink
from swarmctl.links.link_kinds import kinds
from swarmctl.text_patterns import matching
from swarmctl.units import Unit

#: Tags of the two forms of `args`; brackets mark a step that is in no file.
ARGUMENTS, WORDS = "[arguments]", "[words]"
Arguments = dict[str, Value]
Words = tuple[Printable, ...]
Device = Annotated[str, matching(
    r"^/dev/[A-Za-z0-9._/+=@,~-]+$", "write the path of a device, like /dev/video0", examples=["/dev/video0"],
)]  # fmt: skip


def _form(value: Any) -> str:
    return ARGUMENTS if isinstance(value, dict) else WORDS


#: Words of a command line, or arguments of a launch file by name.
Args = Annotated[Annotated[Words, Tag(WORDS)] | Annotated[Arguments, Tag(ARGUMENTS)], Discriminator(_form)]


class RosLaunchable(Model):
    """An executable or a launch file of a ROS package, with what it is started with.

    Subclasses add what they need besides, and report `start_errors` and `argument_errors` where they apply.
    """

    package: PackageName | None = Field(None, description="ROS package.")
    executable: FileName | None = Field(None, description="Executable of the package.")
    launch: LaunchFile | None = Field(
        None,
        description="Launch file in the package's folder `launch`, or in a folder of it.",
        examples=["joystick.launch"],
    )
    params: dict[str, Parameter] = Field(
        default_factory=dict,
        description="Private parameters: values, lists and mappings; the arguments of a launch file.",
        examples=[{"device": "/dev/input/js0"}],
    )
    args: Args = Field(
        (),
        description="The words of its command line; for a launch file its arguments by name.",
        examples=[["--rate", "10"]],
    )
    namespace_argument: Printable | None = Field(
        None,
        description="The argument by which its launch file puts its nodes into its namespace itself; by "
        "default swarmctl puts them there.",
        examples=["namespace"],
    )
    remap: dict[GraphName, GraphName] = Field(
        default_factory=dict, description="Names to change.", examples=[{"cmd_vel": "/k3/cmd_vel"}]
    )
    environment: dict[EnvironmentKey, Printable] = Field(
        default_factory=dict, description="Environment variables.", examples=[{"LANG": "C.UTF-8"}]
    )

    @property
    def words(self) -> tuple[str, ...]:
        """The words of its command line; none of a launch file."""
        return () if isinstance(self.args, dict) else self.args

    @property
    def arguments(self) -> dict[str, Parameter]:
        """The arguments of its launch file, that of the namespace included; none of an executable."""
        own = {} if self.namespace_argument is None else {self.namespace_argument: "{namespace}"}
        return {} if self.launch is None else {**own, **self._written_arguments}

    @property
    def _written_arguments(self) -> dict[str, Parameter]:
        """The arguments that the spec has under `args`, or an older one under `params`."""
        return self.args if isinstance(self.args, dict) and self.args else self.params

    def namespace_around(self, namespace: str) -> str:
        """Returns ``namespace`` without its slash, or nothing where the launch file sets it itself."""
        return "" if self.namespace_argument is not None else namespace[1:]

    @property
    def named_values(self) -> tuple[Literal["args", "params"], dict[str, Parameter]]:
        """Its parameters, or the arguments of its launch file, behind the key under which they stand."""
        if self.launch is None:
            return "params", self.params
        return "params" if self.params else "args", self.arguments

    def start_errors(self) -> Iterator[ConsistencyError]:
        """Yields an error unless it is exactly one of an executable and a launch file, of a package."""
        if self.package is None:
            yield ConsistencyError("`package` is missing; add the ROS package that has it")
        if self.executable is not None and self.launch is not None:
            yield ConsistencyError(
                "it has both an `executable` and a `launch` file; keep one: a launch file starts its nodes",
                "launch",
            )
        elif self.executable is None and self.launch is None:
            yield ConsistencyError("add `executable: NODE`, or `launch: FILE.launch`", "package")

    def argument_errors(self) -> Iterator[ConsistencyError]:
        """Yields an error where `args` do not fit what is started, or repeat `params` or the namespace."""
        if self.launch is not None and self.args:
            if not isinstance(self.args, dict):
                yield ConsistencyError(
                    "a launch file has arguments by name; write args: {NAME: VALUE}", "args"
                )
            elif self.params:
                yield ConsistencyError(
                    "the arguments of a launch file stand under both `args` and `params`; "
                    "move those of `params` to `args`",
                    "params",
                )
        elif self.launch is None and isinstance(self.args, dict):
            yield ConsistencyError(
                "only a launch file has arguments by name; write a node's parameters under `params`, and "
                "the words of its command line as a list",
                "args",
            )
        name = self.namespace_argument
        if name is not None and self.launch is None:
            yield ConsistencyError(
                "only a launch file has arguments; remove `namespace_argument`", "namespace_argument"
            )
        elif name is not None and name in self._written_arguments:
            yield ConsistencyError(
                f"`{name}` gets the namespace by `namespace_argument`; remove one of the two",
                self.named_values[0],
                name,
            )


class Topic(Model):
    """A topic that a program or a robot's sketch publishes or subscribes to. Relative to its namespace."""

    topic: GraphName = Field(description="Its ROS name.")
    type: TypeName = Field(description="Its message type.")
    rate: Annotated[float, Field(gt=0, le=10_000), Unit("Hz")] | None = Field(
        None, examples=[30.0], description="Messages per second, for the budgets of links."
    )
    size: Annotated[int, Field(ge=1), Unit("B")] | None = Field(
        None,
        examples=[921600],
        description="Size of a message as sent, where its type does not fix it (images, maps, text).",
    )


#: As ROS 2 names it; a service of ROS 1, which has no middle part, too.
ServiceType = Annotated[str, matching(
    r"^[A-Za-z][A-Za-z0-9_]*/(srv|action)/[A-Za-z][A-Za-z0-9_]*$",
    "write a service as package/srv/Type, like std_srvs/srv/Trigger, and an action as package/action/Type, "
    "like nav2_msgs/action/NavigateToPose", max_length=200, examples=["std_srvs/srv/Trigger"],
)]  # fmt: skip


class Service(Model):
    """A service or an action that a node provides or calls. Relative to its namespace."""

    name: GraphName = Field(description="Its ROS name.", examples=["save_map"])
    type: ServiceType = Field(
        description="Its type: package/srv/Type of a service, package/action/Type of an action."
    )


Loc = tuple[str | int, ...]

_OF_ANY_ROBOT = {
    "robot": "the robot's name",
    "namespace": "its ROS namespace, without the leading slash",
    "frame": "the prefix of its frames, without the slash behind it",
    "host": "the host of its driver",
    "address": "the address of that host",
}
_PART = re.compile(r"\{\{|\}\}|\{([^{}]*)\}|\{")
_BRACES = {"{{": "{", "}}": "}"}


class PlaceholderError(ValueError):
    """A placeholder without a value. ``name`` is what stands in braces."""

    def __init__(self, name: str, known: Mapping[str, object]) -> None:
        available = ", ".join(f"{{{one}}}" for one in known)
        super().__init__(f"`{{{name}}}` is not available; write one of {available}, or `{{{{` for a brace")
        self.name = name


def is_placeholder(name: str) -> bool:
    """Returns True for a placeholder of any robot, or of a kind of links."""
    return name in _OF_ANY_ROBOT or any(name in model.placeholders for _, model in kinds(RobotLink))


def meanings() -> Mapping[str, str]:
    """Returns every placeholder with its meaning; those of a kind of links need such a link."""
    forms: dict[str, str] = {}
    titles: dict[str, list[str]] = {}
    for _, model in kinds(RobotLink):
        for name, form in model.placeholders.items():
            forms.setdefault(name, form)
            titles.setdefault(name, []).append(model.title)
    last = {"uri": forms.pop("uri")}
    of_links = {name: form.format(_either(*titles[name])) for name, form in (forms | last).items()}
    return _OF_ANY_ROBOT | of_links


def _either(*words: str) -> str:
    return " or ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)


def texts_in(value: Parameter, *place: str | int) -> Iterator[tuple[Loc, str]]:
    """Yields each text of a value, list or mapping, behind its place below ``place``."""
    if isinstance(value, str):
        yield place, value
    elif isinstance(value, Mapping):
        for key, one in value.items():
            yield from texts_in(one, *place, key)
    elif isinstance(value, (list, tuple)):
        for index, one in enumerate(value):
            yield from texts_in(one, *place, index)


def placeholders_in(text: str) -> Iterator[str]:
    """Yields what stands in braces in a text."""
    for part in _PART.finditer(text):
        if part[0] not in _BRACES:
            yield part[1] or ""


def escaped(text: str) -> str:
    """Returns a text that ``filled`` turns back into ``text``."""
    return text.replace("{", "{{").replace("}", "}}")


def filled(value: Parameter, values: Mapping[str, str | int]) -> Any:
    """Returns ``value`` with the placeholders of its texts filled in, also of those in lists and mappings.

    Text that is one placeholder gets the type of what fills it. Raises PlaceholderError for one that
    is not in ``values``.
    """
    if isinstance(value, Mapping):
        return {key: filled(one, values) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [filled(one, values) for one in value]
    return _filled_text(value, values) if isinstance(value, str) else value


def _filled_text(text: str, values: Mapping[str, str | int]) -> str | int:
    for name in placeholders_in(text):
        if name not in values:
            raise PlaceholderError(name, values)
    whole = _PART.fullmatch(text)
    if whole is not None and whole[0] not in _BRACES:
        return values[whole[1]]
    return _PART.sub(lambda part: _BRACES.get(part[0]) or str(values[part[1]]), text)
