"""What a spec has installed on hosts: packages by name, and ROS packages of its own."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from swarmctl.field_types import Model
from swarmctl.text_patterns import matching

DebianPackage = Annotated[str, matching(
    r"^[a-z0-9][a-z0-9.+-]{1,100}$", "a Debian package has lower-case letters, digits and . + -, like htop",
    examples=["python3-numpy"], description="As apt takes it.",
)]  # fmt: skip
PythonPackage = Annotated[str, matching(
    r"^[A-Za-z0-9][A-Za-z0-9._-]{0,100}(==[A-Za-z0-9][A-Za-z0-9.+!_-]{0,60})?$",
    "a Python package is a name, or a name and an exact version: `numpy` or `numpy==1.24.4`",
    examples=["numpy==1.24.4"], description="A name, with or without `==` and a version.",
)]  # fmt: skip


class Install(Model):
    """Packages that `swarmctl prepare` installs."""

    apt: tuple[DebianPackage, ...] = Field((), description="Debian packages.", examples=[["python3-numpy"]])
    pip: tuple[PythonPackage, ...] = Field(
        (),
        description="Python packages, for all accounts of the host; better take by `apt` what Debian has.",
        examples=[["crcmod==1.7"]],
    )


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
