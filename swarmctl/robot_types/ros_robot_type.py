"""A robot type without a protocol: a ROS package that exists already drives it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import Discriminator, Field, Tag

from swarmctl.field_types import (
    KEY,
    Baud,
    ConsistencyError,
    FilePath,
    Model,
    Port,
    RobotAddress,
    fits_together,
)
from swarmctl.links.link_base import RobotLink
from swarmctl.links.link_kinds import RobotLinkKind, kinds
from swarmctl.plugins import LINK_KINDS
from swarmctl.robot_types.kinematics import Motion
from swarmctl.robot_types.robot_type import Text
from swarmctl.robot_types.ros_driver import DRIVER, RosDriver
from swarmctl.robot_types.settings import CommandSettings, RobotSettings
from swarmctl.units import Unit

#: Tag of several drivers; brackets mark a step that is in no file.
DRIVERS = "[drivers]"


def _driver_form(value: Any) -> str:
    return DRIVERS if isinstance(value, (list, tuple)) else DRIVER


class RosLink(Model):
    """What connects the robot with the host of its driver."""

    kinds: Annotated[tuple[RobotLinkKind, ...], Field(min_length=1, strict=False)] = Field(
        examples=[["serial"]], description="What the robot can be connected by."
    )
    baud: Baud | None = Field(None, description="Bits per second of a serial link, unless the link sets it.")
    port: Port | None = Field(
        None,
        examples=[8889],
        description="The robot's port of a udp or tcp link, unless the link sets it.",
    )
    local_ports: tuple[Port, ...] = Field(
        (),
        max_length=8,
        examples=[[8890, 6038]],
        description="Ports of the host of a udp or tcp link on which the driver receives what the robot "
        "sends, unless the link sets them. Two robots of one host need different ones.",
    )
    host_address: RobotAddress | None = Field(
        None,
        examples=["192.168.186.3"],
        description="The host's address on the network of a udp or tcp link that it shares with the robot "
        "alone, unless the link sets it.",
    )
    load_mbps: Annotated[float, Field(gt=0, le=100_000), Unit("Mbit/s")] | None = Field(
        None,
        examples=[4.0],
        description="What host and robot exchange over a udp or tcp link, as measured; by default what its "
        "topics of known rate and size add up to.",
    )

    @fits_together
    def _has_what_its_kinds_have(self) -> Iterator[ConsistencyError]:
        for key in ("port", "local_ports", "host_address", "load_mbps", "baud"):
            if getattr(self, key) and all(key not in LINK_KINDS.get(kind).type_keys for kind in self.kinds):
                having = " or ".join(name for name, model in kinds(RobotLink) if key in model.type_keys)
                yield ConsistencyError(f"`{key}` is of a {having} link, which is not among `kinds`", key)


class RosRobotType(Model):
    """One kind of robot whose driver is a ROS package."""

    title: Text = Field(examples=["ROBOTIS TurtleBot3 Burger"], description="What people call it.")
    driver: Annotated[
        Annotated[RosDriver, Tag(DRIVER)]
        | Annotated[tuple[RosDriver, ...], Field(min_length=1), Tag(DRIVERS)],
        Discriminator(_driver_form),
    ] = Field(
        examples=[{"package": "rosaria", "executable": "RosAria", "params": {"port": "{device}"}}],
        description="The ROS package that drives it; a list where ROS distributions have different ones.",
    )
    kinematics: Motion = Field(
        examples=[{"kind": "differential", "linear_max": 0.22, "angular_max": 2.84}],
        description="How it moves.",
    )
    link: RosLink | None = Field(
        None,
        examples=[{"kinds": ["serial"], "baud": 115200}],
        description="What connects it with its host; left out where the host itself is the robot's computer.",
    )
    urdf: FilePath | None = Field(
        None,
        examples=["urdf/turtlebot3.urdf"],
        description="A URDF with its shape, by its path from the spec's folder: the `robot_description` of "
        "its robots.",
    )
    settings: CommandSettings = Field(
        default_factory=CommandSettings, description="What differs from swarmctl's own defaults."
    )
    source: Text = Field(
        "",
        examples=["https://github.com/ROBOTIS-GIT/turtlebot3"],
        description="Where its launch files and parameters are published.",
    )
    tried: Text = Field(
        "", examples=["not on a robot"], description="What was tried with it, and what was not."
    )

    @property
    def drivers(self) -> tuple[RosDriver, ...]:
        """Its driver, or its drivers for different distributions."""
        return self.driver if isinstance(self.driver, tuple) else (self.driver,)

    def driver_of(self, distro: str) -> RosDriver:
        """Returns the driver for a ROS distribution; one of another if there is none."""
        return next((one for one in self.drivers if one.is_for(distro)), self.drivers[0])

    def place_of(self, driver: RosDriver) -> tuple[str | int, ...]:
        """Returns where one of its drivers stands in its file."""
        if driver is self.driver:
            return ("driver",)
        return "driver", next(index for index, one in enumerate(self.drivers) if one is driver)

    @fits_together
    def _has_one_driver_of_each_distro(self) -> Iterator[ConsistencyError]:
        taken: dict[str, int] = {}
        for index, one in enumerate(self.drivers if isinstance(self.driver, tuple) else ()):
            if not one.distros:
                yield ConsistencyError(
                    "`distros` is missing; name the ROS distributions of each driver in the list",
                    "driver", index,
                )  # fmt: skip
            for number, distro in enumerate(one.distros):
                if taken.setdefault(distro, index) != index:
                    yield ConsistencyError(
                        f"an earlier driver in the list is for `{distro}`; remove one of the two",
                        "driver", index, "distros", number,
                    )  # fmt: skip

    @fits_together
    def _has_a_battery(self) -> Iterator[ConsistencyError]:
        topics = (topic for one in self.drivers for topic in one.publishes)
        if self.settings.battery and not any(one.type == "sensor_msgs/BatteryState" for one in topics):
            yield ConsistencyError(
                "its driver `publishes` no topic of type sensor_msgs/BatteryState; add it, or take this out",
                "settings", "battery", KEY,
            )  # fmt: skip

    @property
    def settings_layer(self) -> RobotSettings:
        """Its settings as one layer of a robot's."""
        return RobotSettings.model_validate(self.settings.model_dump(exclude_unset=True))
