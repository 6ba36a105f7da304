"""What a spec has installed on a host beside what its robots and programs need anyway."""

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
