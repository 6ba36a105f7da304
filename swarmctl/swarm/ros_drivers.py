"""The ROS package that drives a robot: of the robot itself, of the catalog, or of its type. Pure."""

from __future__ import annotations

from collections.abc import Mapping

from swarmctl.robot_types.any_robot_type import SWARMCTL
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.ros_driver import RosDriver
from swarmctl.robot_types.ros_launchable import filled
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.spec.load import Document


def ros_driver_of(document: Document, robot: str, distro: str) -> RosDriver | None:
    """Returns the ROS package of ``distro`` that drives ``robot``; None where swarmctl's driver does.

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
        driver = robot_type.driver_of(distro) if isinstance(robot_type, RosRobotType) else None
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
    args = driver.args if driver.namespace_argument is None else driver.arguments
    return driver.model_copy(
        update={
            "params": filled(driver.params, values) if args is driver.args else {},
            "args": filled(args, values)
            if isinstance(args, dict)
            else tuple(str(filled(word, values)) for word in args),
            "remap": {
                str(filled(old, values)): str(filled(new, values)) for old, new in driver.remap.items()
            },
            "odom_frame": str(filled(driver.odometry_frame, values)),
            "peer_namespace": driver.peer_namespace and str(filled(driver.peer_namespace, values)),
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
