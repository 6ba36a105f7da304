"""A robot type whose driver is a ROS package, as text."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from swarmctl.robot_types.driver_params import command_timeout_of
from swarmctl.robot_types.ros_driver import RosDriver
from swarmctl.robot_types.ros_launchable import Topic
from swarmctl.robot_types.ros_robot_type import RosLink, RosRobotType
from swarmctl.views.escape import printable

Rows = Iterable[tuple[str, ...]]


def sections(kind: RosRobotType) -> Iterator[tuple[str, Rows]]:
    """Yields each heading with its rows."""
    for driver in kind.drivers:
        yield _heading("Driver", driver), _launched(driver)
    if kind.link is not None:
        yield "Link", _link(kind.link)
    yield "Limits", _limits(kind)
    for driver in kind.drivers:
        yield _heading("Publishes", driver), _topics(driver.publishes)
        commands = [(driver.command, driver.command_type)] if kind.kinematics.kind != "none" else []
        yield _heading("Subscribes", driver), [*commands, *_topics(driver.subscribes)]
        yield _heading("When commands stop", driver), _dead_man(kind, driver)
    if kind.source or kind.tried:
        yield "Origin", (("source", printable(kind.source)), ("tried", printable(kind.tried)))


def _heading(what: str, driver: RosDriver) -> str:
    return f"{what} ({', '.join(driver.distros)})" if driver.distros else what


def _link(link: RosLink) -> Iterator[tuple[str, ...]]:
    yield "kinds", ", ".join(link.kinds)
    if link.baud is not None:
        yield "baud", f"{link.baud}"
    if link.port is not None:
        yield "port", f"{link.port} of the robot"
    if link.local_ports:
        yield "local ports", f"{', '.join(map(str, link.local_ports))} of the host"
    if link.host_address is not None:
        yield "host address", f"{link.host_address} of the host"
    if link.load_mbps is not None:
        yield "load", f"{link.load_mbps:g} Mbit/s"


def _launched(driver: RosDriver) -> Iterator[tuple[str, ...]]:
    yield "package", ", ".join(driver.packages)
    yield ("launch file", driver.launch) if driver.launch else ("executable", driver.executable or "")
    for (key, *names), value in driver.texts:  # `params` and the like have names, a frame has none
        yield str(key), "".join(f"{one}: " for one in names[:1]) + printable(str(value))
    for old, new in driver.remap.items():
        yield "remap", f"{old} to {new}"


def _limits(kind: RosRobotType) -> Iterator[tuple[str, ...]]:
    yield "kinematics", kind.kinematics.kind
    names = ("forward", "sideways", "up"), kind.kinematics.axes[:3]
    for name, fastest in zip(*names, strict=True):
        if fastest:
            yield name, f"{fastest:g} m/s"
    if kind.kinematics.axes[3]:
        yield "turn", f"{kind.kinematics.axes[3]:.3g} rad/s"


def _topics(topics: Iterable[Topic]) -> Iterator[tuple[str, ...]]:
    for one in topics:
        yield one.topic, one.type, *([f"{one.rate:g} Hz"] if one.rate else [])


def _dead_man(kind: RosRobotType, driver: RosDriver) -> Iterator[tuple[str, ...]]:
    if kind.kinematics.kind == "none":
        yield "gate", "none: it takes no commands"
        return
    if driver.ungated:
        yield "gate", f"none: {printable(driver.reason or '')}"
    else:
        yield "gate", f"stops the robot after {command_timeout_of(kind.settings_layer):g} s"
    if driver.stops_after is not None:
        yield "driver", f"stops the robot after {driver.stops_after:g} s"
    else:
        yield "driver", "not known to stop the robot by itself"
