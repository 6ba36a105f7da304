"""The configuration file of a robot's driver."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

from swarm_onboard.agent.paths import stop_file
from swarm_onboard.driver import live_values
from swarm_onboard.driver.live_values import shown_params

from swarmctl.render import sketch
from swarmctl.render.bundle import File
from swarmctl.render.quoting import render, xml
from swarmctl.render.yaml_params import entries, file_of
from swarmctl.robot_types.driver_params import common_params, own_params, watchdog_of
from swarmctl.swarm import names
from swarmctl.swarm.command_topics import COMMAND_TYPE
from swarmctl.swarm.resolved import Commander, ForeignDriver, Robot, Swarm, SwarmctlDriver
from swarmctl.swarm.topics import WHEEL_JOINTS

_FLAT = 0.02  # m; the height of a body of which nothing is known
_NAMELESS = b'<robot name="">'
Place = tuple[float, float, float, float]


def urdf(robot: str, model: bytes) -> bytes:
    """Returns the URDF of a robot: the ``model`` that it shares with others, and its name."""
    return model.replace(_NAMELESS, f"<robot name={xml(robot)}>".encode(), 1)


def model_of(params: Mapping[str, Any]) -> bytes:
    """Returns the URDF, without a name, of the robots whose drivers read ``params``, in m and rad.

    Its origin is the middle of the wheels' axis; link and joint names are without the robot's name, as
    `robot_state_publisher` and RViz expect them beside a `tf_prefix`.
    """
    kinematics, places = params["kinematics"], list(_places(params["sensors"]))
    radius, half = kinematics.get("wheel_radius"), kinematics["wheel_separation"] / 2
    return render(
        "robot.urdf",
        robot="",
        sensors=places,
        body_radius=round(max([half, *(math.hypot(x, y) for x, y, _, _ in places)]), 4),
        height=round(max([2 * radius if radius else _FLAT, *(place[2] for place in places)]), 4),
        wheel_radius=radius,
        wheels=tuple(zip(WHEEL_JOINTS, (half, -half), strict=True)) if radius else (),
    )


def _places(sensors: Mapping[str, Any]) -> Iterator[Place]:
    """Yields x, y, z and the heading of every distance sensor and camera, on or off."""
    for sensor in sensors.values():
        for one in sensor.get("elements", ()):
            yield one["x"], one["y"], one["z"], round(math.radians(one["heading_deg"]), 4)
        if sensor["kind"] == "image":
            yield sensor["x"], sensor["y"], sensor["z"], 0.0


def parameters(robot: Robot, driver: SwarmctlDriver, stop_file: str = "") -> tuple[bytes, bytes]:
    """Returns what swarmctl's driver of ``robot`` reads, as YAML; and without what it takes while it runs.

    ``stop_file``: its latch on the host.
    """
    common = _common(tuned(robot, driver))
    if (made := sketch.sketch_of(robot)) is not None:
        protocol = {**common.params["protocol"], "digest": made.digest}
        common = _Common.of({**common.params, "protocol": protocol})
    rest: dict[str, Any] = {"urdf": f"../{urdf_path(robot)}"}
    if robot.start is not None:
        rest["start"] = robot.start.model_dump()
    if robot.command_type != COMMAND_TYPE:
        rest["command_type"] = robot.command_type
    if stop_file:
        rest["stop_file"] = stop_file
    rest["commanders"] = [commander_params(one) for one in robot.commanders]
    before, after = entries(_own(robot, driver)), entries(rest)
    return file_of(before, common.text, after), file_of(before, common.fixed, after)


def set_parameters(robot: Robot, driver: SwarmctlDriver) -> dict[str, Any]:
    """Returns the ROS parameters that the driver of ``robot`` sets."""
    commanders = [commander_params(one) for one in robot.commanders]
    return shown_params({**_own(robot, driver), **tuned(robot, driver).params, "commanders": commanders})


def _own(robot: Robot, driver: SwarmctlDriver) -> dict[str, Any]:
    return own_params(driver.type, robot=robot.name, namespace=robot.namespace, port=driver.line.path)


@dataclass(frozen=True)
class Tuned:
    """What robots of one type with equal settings share, with the ``robot`` and ``driver`` of one of them."""

    settings_id: int  # of ``robot.settings`` and
    type_id: int  # of ``driver.type``, which live as long as this
    baud: int
    module: str
    robot: Robot = field(compare=False)
    driver: SwarmctlDriver = field(compare=False)

    @property
    def params(self) -> Mapping[str, Any]:
        """The parameters that the robots share."""
        return _common(self).params


def tuned(robot: Robot, driver: SwarmctlDriver) -> Tuned:
    """Returns what ``robot`` shares; equal for robots with the same type, settings and baud rate."""
    return Tuned(id(robot.settings), id(driver.type), driver.baud, f"../{codec_path(robot)}", robot, driver)


class _Common(NamedTuple):
    """The parameters that all robots with one type and equal settings share.

    As data, as text, and as text without the live values.
    """

    params: Mapping[str, Any]
    text: str
    fixed: str

    @classmethod
    def of(cls, params: Mapping[str, Any]) -> _Common:
        """Returns ``params`` in all forms."""
        return cls(params, entries(params), entries(live_values.fixed(params)))


@lru_cache(maxsize=1024)
def _common(shared: Tuned) -> _Common:
    common = common_params(shared.driver.type, shared.robot.settings, shared.baud, shared.module)
    return _Common.of(common)


def params_path(robot: Robot) -> str:
    """Returns its path in the release."""
    return f"params/{robot.name}.yaml"


def urdf_path(robot: Robot) -> str:
    """Returns the path in the release of the robot's URDF."""
    return f"urdf/{robot.name}.urdf"


def codec_path(robot: Robot) -> str:
    """Returns the path in the release of the file with the protocol class of the robot's type."""
    return f"codecs/{robot.type_name}.py"


def commander_params(commander: Commander) -> dict[str, Any]:
    """Returns an entry of `commanders`, as driver and gate read it."""
    return {
        "name": commander.name,
        "priority": commander.priority,
        "nodes": list(commander.nodes),
        "namespace": commander.namespace,
        "hosts": list(commander.hosts),
        "addresses": list(commander.addresses),
    }


def remapped(robot: Robot, driver: ForeignDriver) -> dict[str, str]:
    """Returns the names to change: a gated driver takes its commands from the gate, wherever from before.

    Both names are absolute: in a relative one, each node of a launch file would see its own namespace.
    """
    ros = driver.ros
    if not driver.gated:
        return dict(ros.remap)
    node, full = robot.driver_node, names.resolved(ros.command, robot.driver_node, {})
    kept = {old: new for old, new in ros.remap.items() if names.resolved(old, node, {}) != full}
    command = ros.command if ros.command.startswith("~") else full
    return {**kept, command: f"{robot.namespace}/{names.GATE_OUTPUT}"}


def config_files(swarm: Swarm, robot: Robot, driver: SwarmctlDriver) -> Iterator[File]:
    """Yields the files that the driver of ``robot`` reads."""
    content, fixed = parameters(robot, driver, stop_file(swarm.name, robot.name))
    yield File(params_path(robot), content, origin=f"robots.{robot.name}", fixed=fixed)
    own = robot.urdf.content if robot.urdf is not None else None
    made = own if own is not None else urdf(robot.name, _model(tuned(robot, driver)))
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
    return model_of(shared.params)


@lru_cache(maxsize=1024)
def _watchdog(shared: Tuned) -> str:
    return f"{watchdog_of(shared.driver.type, shared.baud, shared.robot.settings):.3g}"
