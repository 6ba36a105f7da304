"""The drivers of a host that are ROS packages: launch files, parameters, URDFs, units."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from typing import Any

from swarmctl.render.bundle import File, Part, Unit
from swarmctl.render.driver_config import params_path, remapped, urdf_path
from swarmctl.render.quoting import render
from swarmctl.render.ros1 import delivered_packages
from swarmctl.render.ros1.programs import roslaunched
from swarmctl.render.ros1.release import ROS_CLIENT, RUNNING, as_client
from swarmctl.render.service_values import home
from swarmctl.render.yaml_params import params_file
from swarmctl.swarm import names, used_packages
from swarmctl.swarm.resolved import ForeignDriver, Host, Robot, Swarm


def files(swarm: Swarm, robot: Robot, driver: ForeignDriver) -> Iterator[File]:
    """Yields the launch file of a robot, for its unit and for people, and the parameters of its node."""
    ros, origin = driver.ros, f"robots.{robot.name}"
    text = render(
        "program.launch",
        group=driver.ros.namespace_around(robot.namespace),
        node=names.DRIVER_NODE,
        package=ros.package,
        executable=ros.executable,
        launch=ros.launch,
        arguments=list(ros.arguments.items()),
        words=shlex.join(ros.words),
        loaded=[{"file": f"{home(swarm)}/current/{params_path(robot)}"}]
        if ros.params and ros.executable
        else [],
        remap=list(remapped(robot, driver).items()),
        environment=list(ros.environment.items()),
        own=names.unit(swarm.name, robot.name),
        by_hand=[names.unit(swarm.name, robot.name)],
        urdf=f"{home(swarm)}/current/{urdf_path(robot)}" if robot.urdf is not None else "",
    )
    yield File(launch_path(robot), text, origin=origin)
    if robot.urdf is not None:
        yield File(urdf_path(robot), robot.urdf.content, origin=origin)
    if ros.params and ros.executable:
        yield File(params_path(robot), params_file(ros.params), origin=origin)


def unit(swarm: Swarm, host: Host, robot: Robot, driver: ForeignDriver, common: dict[str, Any]) -> Part:
    """Returns the unit of a robot's driver. It stops no motors: the gate in front of it does."""
    name = names.unit(swarm.name, robot.name)
    path = f"{home(swarm)}/current/{launch_path(robot)}"
    command = as_client(swarm, roslaunched(path, driver.ros, driver.ros.environment), forever=True)
    file = File(
        f"units/{name}",
        render("ros_driver.service", **common, user=host.user, command=command),
        origin=f"robots.{robot.name}",
    )
    params = (params_path(robot),) if driver.ros.params and driver.ros.executable else ()
    urdf = (urdf_path(robot),) if robot.urdf is not None else ()
    own_packages = used_packages.of_driver(swarm, driver)
    own = (one.path for one in delivered_packages.files(swarm, host, own_packages))
    needs = (file.path, *RUNNING, ROS_CLIENT, launch_path(robot), *params, *urdf, *own)
    return Part((file,), (Unit(name, needs, robot=robot.name),))


def launch_path(robot: Robot) -> str:
    """Returns the path of a robot's launch file in the release."""
    return f"launch/{robot.name}.launch"
