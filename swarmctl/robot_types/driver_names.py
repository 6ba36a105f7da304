"""The names that `driver` of a robot may be: swarmctl's own, and the ROS packages of the catalog."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

from swarmctl import resources

SWARMCTL = "swarmctl"


class DriverNames:
    """Names of drivers; each but the first is a file of the catalog."""

    @cached_property
    def files(self) -> dict[str, Path]:
        """The files of the catalog, by the name of their driver."""
        return {file.stem: file for file in sorted((resources.templates() / "drivers").glob("*.yaml"))}

    def names(self) -> tuple[str, ...]:
        """Returns every name, swarmctl's first."""
        return (SWARMCTL, *self.files)

    def __contains__(self, name: object) -> bool:
        return name == SWARMCTL or name in self.files


DRIVERS = DriverNames()
