"""A ROS package as driver: how it is launched, what it publishes, where it takes commands."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Annotated, get_args

from pydantic import Field

from swarmctl.field_types import (
    ConsistencyError,
    DriverName,
    FrameName,
    GraphName,
    PackageName,
    Printable,
    TypeName,
    fits_together,
)
from swarmctl.plugins import MIDDLEWARES, NameIn
from swarmctl.robot_types.ros_launchable import (
    Device,
    Loc,
    RosLaunchable,
    Service,
    Topic,
    is_placeholder,
    meanings,
    placeholders_in,
    texts_in,
)
from swarmctl.robot_types.settings import VelocityType
from swarmctl.units import Unit

BASE_FRAME = re.compile(r"(robot_)?base_(link_|footprint_)?frame(_id)?")
_ODOMETRY_FRAME = re.compile(r"odom(etry)?_frame(_id)?")
_PREFIX = re.compile(r"(.*_)?prefix|multi_robot_name")
_TF = re.compile(r"(.*_)?tf(_.*)?")  # such as publish_tf
VELOCITIES: tuple[str, ...] = get_args(VelocityType)  # what a gate takes and sends


#: Tag of a driver where other forms may stand; brackets mark a step that is in no file.
DRIVER = "[driver]"


class RosDriver(RosLaunchable):
    """A ROS package that drives the robot: one of its executables, or a launch file.

    Its node is called `driver`. Texts of `params`, `args` and `environment` may have placeholders such as
    `{namespace}` and `{device}`.
    """

    distros: tuple[Annotated[str, NameIn(MIDDLEWARES)], ...] = Field(
        (),
        examples=[[MIDDLEWARES.default]],
        description="ROS distributions for which it exists; by default that of the swarm, whichever it is.",
    )
    package: PackageName = Field(examples=["rosaria"], description="Its ROS package.")
    command: GraphName = Field(
        "cmd_vel",
        examples=["mobile_base/commands/velocity"],
        description="Topic on which its node takes commands, in the robot's namespace or absolute.",
    )
    command_type: TypeName = Field(
        "geometry_msgs/Twist",
        examples=["geometry_msgs/TwistStamped"],
        description="Message type of its commands: geometry_msgs/Twist or geometry_msgs/TwistStamped, or any "
        "other with `ungated: true`.",
    )
    publishes: tuple[Topic, ...] = Field(
        (),
        examples=[[{"topic": "odom", "type": "nav_msgs/Odometry", "rate": 30.0}]],
        description="Topics it publishes; `status` checks them.",
    )
    subscribes: tuple[Topic, ...] = Field((), description="Topics it subscribes to beside its commands.")
    provides: tuple[Service, ...] = Field(
        (),
        examples=[[{"name": "dock", "type": "irobot_create_msgs/action/Dock"}]],
        description="Services and actions it provides; `status` checks them.",
    )
    odom_frame: FrameName | None = Field(
        None,
        examples=["{frame}/odom"],
        description="Frame of its odometry: by default `{frame}/odom` where a text of the driver has "
        "`{frame}`, else `odom`. The gate publishes the robot's `start` as the transform from `map` to it.",
    )
    base_frame: FrameName | None = Field(
        None,
        examples=["{frame}/base_link"],
        description="Frame of the robot's base, where it publishes the transform from the frame of its "
        "odometry to it; by default the text of a parameter or argument such as `base_frame`.",
    )
    devices: tuple[Device, ...] = Field(
        (),
        examples=[["/dev/kobuki"]],
        description="Devices of its host that it opens without a parameter or argument that names them.",
    )
    remap: dict[DriverName, DriverName] = Field(
        default_factory=dict,
        examples=[{"/odom": "odom"}],
        description="Names to change; they may have the placeholder {system_id}.",
    )
    requires: tuple[PackageName, ...] = Field(
        (), examples=[["joy"]], description="ROS packages without which it cannot run."
    )
    stops_after: Annotated[float, Field(gt=0, le=60, examples=[0.6]), Unit("s")] | None = Field(
        None,
        description="Time without a command after which it stops the robot by itself, if it does.",
    )
    peer: bool = Field(
        False,
        description="Whether the robot runs nodes of ROS 2 itself, at the address of its link: the nodes of "
        "its host then look for others there.",
    )
    peer_namespace: Printable | None = Field(
        None,
        examples=["{namespace}/_do_not_use"],
        description="The namespace of the nodes of such a robot, which a person sets on it; `plan` and "
        "`prepare` print it.",
    )
    ungated: bool = Field(
        False,
        description="Whether swarmctl's gate is left out: then every publisher of its command topic commands "
        "the robot, without limits or dead-man.",
    )
    reason: Annotated[Printable, Field(min_length=3)] | None = Field(
        None,
        examples=["the autopilot takes setpoints, not velocities"],
        description="Why it is ungated; status prints it.",
    )

    def is_for(self, distro: str) -> bool:
        """Returns whether it exists for a ROS distribution."""
        return not self.distros or distro in self.distros

    @property
    def names_its_nodes(self) -> bool:
        """Whether it names its nodes itself, as a launch file does, or the firmware behind an agent."""
        return self.launch is not None or self.package == "micro_ros_agent"

    @property
    def texts(self) -> Iterator[tuple[Loc, str]]:
        """Every text that may have placeholders, with its place."""
        yield from texts_in(self.params, "params")
        yield from texts_in(self.args, "args")
        yield from texts_in(self.environment, "environment")
        for key in ("odom_frame", "base_frame", "peer_namespace"):
            if (text := getattr(self, key)) is not None:
                yield (key,), text

    @property
    def placeholders(self) -> Iterator[tuple[Loc, str]]:
        """Every placeholder in its texts and in the names that it changes, with its place."""
        yield from ((loc, one) for loc, text in self.texts for one in placeholders_in(text))
        for old, new in self.remap.items():
            yield from ((("remap", old), one) for one in placeholders_in(old + new))

    @property
    def odometry_frame(self) -> str:
        """The frame of its odometry; it may have placeholders."""
        prefixed = any("frame" in placeholders_in(value) for _, value in self.texts)
        return self.odom_frame or ("{frame}/odom" if prefixed else "odom")

    @property
    def transform(self) -> tuple[str, str] | None:
        """The frames of the transform of its odometry, where they are known; they may have placeholders."""
        base = self.base_frame or self._text_of(BASE_FRAME)
        if base is None or any(
            str(value).lower() == "false" and _TF.fullmatch(name)
            for name, value in self.named_values[1].items()
        ):
            return None
        frames = self.odom_frame or self._text_of(_ODOMETRY_FRAME) or self.odometry_frame, base
        prefix = None if self.base_frame is not None else self._text_of(_PREFIX)
        odom, base = (one if prefix is None or "{" in one else f"{prefix}/{one}" for one in frames)
        return odom, base

    def _text_of(self, name: re.Pattern[str]) -> str | None:
        """Returns the text of the first parameter or argument with such a name."""
        values = self.named_values[1].items()
        return next(
            (one for key, one in values if isinstance(one, str) and one and name.fullmatch(key)), None
        )

    @property
    def packages(self) -> tuple[str, ...]:
        """The packages that must be installed."""
        return tuple(dict.fromkeys((self.package, *self.requires)))

    @fits_together
    def _is_launchable(self) -> Iterator[ConsistencyError]:
        yield from self.start_errors()
        yield from self.argument_errors()

    @fits_together
    def _topics_have_known_names(self) -> Iterator[ConsistencyError]:
        for key, topics in (("publishes", self.publishes), ("subscribes", self.subscribes)):
            for index, one in enumerate(topics if self.launch is not None else ()):
                if one.topic.startswith("~"):
                    yield ConsistencyError(
                        f"`{one.topic}` is private to a node that the launch file names; write `NODE/TOPIC`",
                        key, index, "topic",
                    )  # fmt: skip

    @fits_together
    def _has_a_reason(self) -> Iterator[ConsistencyError]:
        if self.ungated and self.reason is None:
            yield ConsistencyError(
                "`ungated` needs a `reason`; write why no gate can stand before it", "ungated"
            )
        if self.reason is not None and not self.ungated:
            yield ConsistencyError("`reason` belongs to `ungated: true`; remove it", "reason")

    @fits_together
    def _has_nodes_for_its_namespace(self) -> Iterator[ConsistencyError]:
        if self.peer_namespace is not None and not self.peer:
            yield ConsistencyError("`peer_namespace` belongs to `peer: true`; remove it", "peer_namespace")

    @fits_together
    def _commands_are_velocities(self) -> Iterator[ConsistencyError]:
        if not self.ungated and self.command_type not in VELOCITIES:
            yield ConsistencyError(
                f"the gate sends {' or '.join(VELOCITIES)}, not {self.command_type}; "
                "write one of them, or leave the gate out: `ungated: true` with a `reason`",
                "command_type",
            )

    @fits_together
    def _commands_have_a_known_name(self) -> Iterator[ConsistencyError]:
        if self.ungated and self.launch is not None and self.command.startswith("~"):
            yield ConsistencyError(
                f"`{self.command}` is private to a node that the launch file names; write `NODE/TOPIC`",
                "command",
            )

    @fits_together
    def _placeholders_exist(self) -> Iterator[ConsistencyError]:
        for loc, value in self.texts:
            unknown = next((one for one in placeholders_in(value) if not is_placeholder(one)), None)
            if unknown is not None:
                names = ", ".join(f"{{{one}}}" for one in meanings())
                yield ConsistencyError(
                    f"`{{{unknown}}}` is not a placeholder; write one of {names}, or `{{{{` for a brace", *loc
                )
