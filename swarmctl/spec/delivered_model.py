"""The ROS packages of its own that a spec delivers to hosts, as it names them."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from swarmctl.field_types import Model
from swarmctl.text_patterns import matching

PackageFolder = Annotated[str, matching(
    r"^(\./)?[A-Za-z0-9_][A-Za-z0-9._+-]*(/[A-Za-z0-9_][A-Za-z0-9._+-]*)*$",
    "the path of a folder below that of the spec, like ./src/nav", max_length=255, examples=["./src/nav"],
)]  # fmt: skip
PackageKey = Annotated[str, matching(
    r"^[A-Za-z0-9][A-Za-z0-9._+-]{0,100}$", "a name as package.xml has it: letters, digits and . _ + -",
    examples=["gazebo_ros"],
)]  # fmt: skip


class PackageSource(Model):
    """Where a ROS package is that travels with each release, or a workspace of several."""

    # `from` is a word of Python, so no attribute can be declared under this name.
    __annotations__ = {"from": PackageFolder}
    locals()["from"] = Field(
        description="The folder with its package.xml, from that of the spec.", examples=["./src/nav"]
    )
    all: bool = Field(
        False,
        description="Whether the folder is that of a workspace: every package in and below it is delivered "
        "where it is used, and the name of the entry is free.",
    )
    skip_keys: tuple[PackageKey, ...] = Field(
        (),
        examples=[["gazebo_ros"]],
        description="Names in its package.xml that hosts need not have; `prepare` does not look for them.",
    )

    @property
    def folder(self) -> str:
        """The folder of the package, from that of the spec."""
        return str(getattr(self, "from")).removeprefix("./")
