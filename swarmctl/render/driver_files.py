"""The files of swarmctl's own driver that do not depend on its ROS: configuration, URDF, protocol class."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

from swarm_onboard.agent.paths import stop_file

from swarmctl.render import robot_model
from swarmctl.render.bundle import File
from swarmctl.render.driver_config import Tuned, codec_path, parameters, params_path, tuned, urdf_path
from swarmctl.robot_types.driver_params import watchdog_of
from swarmctl.swarm.resolved import Robot, Swarm, SwarmctlDriver


def config_files(swarm: Swarm, robot: Robot, driver: SwarmctlDriver) -> Iterator[File]:
    """Yields the files that the driver of ``robot`` reads."""
    content, fixed = parameters(robot, driver, stop_file(swarm.name, robot.name))
    yield File(params_path(robot), content, origin=f"robots.{robot.name}", fixed=fixed)
    own = robot.urdf.content if robot.urdf is not None else None
    made = own if own is not None else robot_model.urdf(robot.name, _model(tuned(robot, driver)))
    yield File(urdf_path(robot), made, origin=f"robots.{robot.name}")
    if driver.codec:
        yield File(codec_path(robot), driver.codec, origin=f"types.{robot.type_name}")


def watchdog(robot: Robot, driver: SwarmctlDriver) -> str:
    """Returns the time after which the driver of ``robot`` hangs, s."""
    return _watchdog(tuned(robot, driver))


def publishes_start(robot: Robot) -> bool:
    """True if a node of swarmctl publishes the transform from `map` to the robot's start."""
    return robot.start is not None and (robot.gated or isinstance(robot.driver, SwarmctlDriver))


@lru_cache(maxsize=1024)
def _model(shared: Tuned) -> bytes:
    return robot_model.model_of(shared.params)


@lru_cache(maxsize=1024)
def _watchdog(shared: Tuned) -> str:
    return f"{watchdog_of(shared.driver.type, shared.baud, shared.robot.settings):.3g}"
