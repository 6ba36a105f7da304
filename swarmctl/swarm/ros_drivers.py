"""The ROS package that drives a robot: of the robot itself, of the catalog, or of its type. Pure."""

from __future__ import annotations

from collections.abc import Mapping

from swarmctl.robot_types.driver_names import SWARMCTL
from swarmctl.robot_types.placeholders import filled
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.ros_driver import RosDriver
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.spec.link_model import Radio, RobotLink
from swarmctl.spec.load import Document
from swarmctl.swarm.ip_links import IpEnds


def ros_driver_of(document: Document, robot: str) -> RosDriver | None:
    """Returns the ROS package that drives ``robot``, as declared; None where swarmctl's driver does.

    Where the board of the robot speaks rosserial, the topics of its sketch count unless others are declared.
    """
    given = document.spec.robots[robot]
    robot_type = document.types.get(given.type)
    driver: RosDriver | None
    if isinstance(given.driver, RosDriver):
        driver = given.driver
    elif given.driver is not None and given.driver != SWARMCTL:
        driver = document.catalog.drivers[given.driver]
    else:
        driver = robot_type.driver if isinstance(robot_type, RosRobotType) else None
    if driver is None or not isinstance(robot_type, RobotType) or robot_type.sketch is None:
        return driver
    return _of_board(driver, robot_type)


def _of_board(driver: RosDriver, robot_type: RobotType) -> RosDriver:
    sketch, written = robot_type.sketch, driver.model_fields_set
    assert sketch is not None
    own = {
        "publishes": sketch.publishes,
        "subscribes": tuple(one for one in sketch.subscribes if one.topic != driver.command),
        "stops_after": sketch.firmware_timeout,
    }
    return driver.model_copy(update={key: value for key, value in own.items() if key not in written})


def launchable(driver: RosDriver, values: Mapping[str, str | int]) -> RosDriver:
    """Returns a driver with its placeholders filled in.

    Raises PlaceholderError for a placeholder that is not in ``values``.
    """
    args = driver.args
    return driver.model_copy(
        update={
            "params": filled(driver.params, values),
            "args": filled(args, values)
            if isinstance(args, dict)
            else tuple(str(filled(word, values)) for word in args),
            "odom_frame": str(filled(driver.odometry_frame, values)),
            "environment": {key: str(filled(value, values)) for key, value in driver.environment.items()},
        }
    )


def placeholder_values(
    robot: str, namespace: str, host: str, address: str, of_link: Mapping[str, str | int]
) -> Mapping[str, str | int]:
    """Returns what the placeholders of a robot's driver stand for.

    ``address`` is that of its ``host``; ``of_link`` is empty without a link.
    """
    space = namespace[1:]
    return {
        "robot": robot, "namespace": space, "frame": space, "host": host, "address": address, **of_link,
    }  # fmt: skip


def values_of_link(
    link: RobotLink, device: str, baud: int | None, ends: IpEnds | None
) -> Mapping[str, str | int]:
    """Returns what a link gives to the placeholders of a driver.

    ``device`` and ``baud`` are those of a serial or Bluetooth link, ``ends`` those of a udp or tcp link. A
    URI of UDP begins with the first port of the host, as mavros takes it: udp://:14550@192.168.10.2:14555.
    """
    if isinstance(link, Radio):
        return {"uri": link.uri}
    if ends is None:
        return {"device": device, **({"baud": baud, "uri": f"serial://{device}:{baud}"} if baud else {})}
    local, address = ends.local_ports, ends.link.address
    values: dict[str, str | int] = {"link_address": address}
    values |= dict(zip(("local_port", "local_port_2"), local, strict=False))
    if ends.port is not None:
        own = f":{local[0]}@" if local and link.kind == "udp" else ""
        values |= {"link_port": ends.port, "uri": f"{link.kind}://{own}{address}:{ends.port}"}
    return values
