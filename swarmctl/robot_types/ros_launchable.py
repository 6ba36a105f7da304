"""What a ROS program is started with: the keys that programs and the drivers of other packages share."""

from __future__ import annotations

from collections.abc import Iterator
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
    Value,
)
from swarmctl.text_patterns import matching

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
