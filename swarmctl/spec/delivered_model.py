"""The ROS packages of its own that a spec delivers to hosts, as it names them."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from swarmctl.field_types import Model

PackageFolder = Annotated[
    str,
    Field(
        pattern=r"^(\./)?[A-Za-z0-9_][A-Za-z0-9._+-]*(/[A-Za-z0-9_][A-Za-z0-9._+-]*)*$",
        max_length=255,
        examples=["./src/nav"],
    ),
]
PackageKey = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._+-]{0,100}$", examples=["gazebo_ros"])]


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
