"""The sketch of one board: a firmware template, with the robot's wiring and numbers in `config.h`."""

from __future__ import annotations

import hashlib
from dataclasses import asdict, dataclass, replace
from typing import Any

from swarmctl import resources
from swarmctl.render import shipped_files
from swarmctl.render.bundle import File
from swarmctl.render.quoting import render
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.sketch_settings import DEFAULTS, Firmware, completed
from swarmctl.swarm.resolved import Host, Robot, Swarm

TEMPLATE = "uno-l298n"
CONFIG, VERSION, SKETCH = "config.h", "version.h", "rover.ino"
FASTER = 1.2  # full PWM gives this many times `wheel_speed_max`, unless the spec declares it
DIGITS = 12  # of the digest, enough to distinguish two firmwares of one robot


@dataclass(frozen=True)
class FirmwareSettings:
    """All settings of a sketch, by default for the second paper's kit: lengths in m, times in s, rates
    in Hz, speeds of a wheel on the ground. ``firmware`` is complete but for the wheels' `full_speed`.
    """

    firmware: Firmware = DEFAULTS
    baud: int = 57600
    command_topic: str = "cmd_vel"
    left_ticks_topic: str = "lwheel"
    right_ticks_topic: str = "rwheel"
    ticks_rate: float = 10.0
    wheel_radius: float = 0.0325
    wheel_separation: float = 0.13
    wheel_speed_max: float = 0.5
    dead_man: float = 0.4

    def values(self) -> dict[str, Any]:
        """Returns the template values of `config.h`."""
        data = {**asdict(self), **self.firmware.model_dump()}
        for side in ("left", "right"):
            data[side]["full_speed"] = data[side]["full_speed"] or FASTER * self.wheel_speed_max
        return data


@dataclass(frozen=True)
class Sketch:
    """The source of a firmware, and the digest that the board reports."""

    name: str
    files: tuple[File, ...]
    digest: str

    @property
    def sources(self) -> dict[str, bytes]:
        """The files by their names in the sketch's folder."""
        return {file.path.removeprefix(f"{self.name}/"): file.content for file in self.files}


def settings_of(robot: Robot) -> FirmwareSettings | None:
    """Returns the settings of a robot's sketch, with the same numbers as its driver's.

    None for a robot whose sketch swarmctl does not write, or that has no line.
    """
    kind = robot.type
    if (
        robot.line is None
        or not isinstance(kind, RobotType)
        or kind.sketch is None
        or kind.sketch.firmware is None
    ):
        return None
    protocol, kinematics, measured = kind.sketch, kind.kinematics, robot.settings.calibration
    assert kinematics.wheel_radius is not None  # the type was refused otherwise
    left, right = protocol.publishes
    return FirmwareSettings(
        firmware=completed(robot.settings.firmware),
        baud=robot.baud or kind.link.baud,
        command_topic=protocol.subscribes[0].topic,
        left_ticks_topic=left.topic,
        right_ticks_topic=right.topic,
        ticks_rate=float(left.rate or 0),
        wheel_radius=kinematics.wheel_radius * (measured.distance_scale or 1.0),
        wheel_separation=measured.wheel_separation or kinematics.wheel_separation,
        wheel_speed_max=kinematics.wheel_speed_max,
        dead_man=protocol.firmware_timeout,
    )


def sketch_of(robot: Robot) -> Sketch | None:
    """Returns the sketch for the robot's board, if swarmctl writes it."""
    settings = settings_of(robot)
    return sketch(robot.name, settings) if settings is not None else None


def files(robot: Robot) -> tuple[File, ...]:
    """Returns the files of the robot's sketch on its host."""
    made, origin = sketch_of(robot), f"robots.{robot.name}"
    return (
        tuple(replace(file, path=f"firmware/{file.path}", origin=origin) for file in made.files)
        if made
        else ()
    )


def wants(swarm: Swarm, host: Host) -> dict[str, tuple[str, ...]]:
    """Returns the programs that a host needs to write firmware to its boards, and the robots with these."""
    robots = tuple(f"robots.{one.name}" for one in swarm.robots_on(host.name) if settings_of(one))
    return {"avrdude": robots} if robots else {}


def sketch(name: str, settings: FirmwareSettings) -> Sketch:
    """Returns the sketch called ``name`` as a folder for the Arduino IDE, with ``<name>.ino`` in it."""
    texts = {
        file.path.removeprefix(f"{TEMPLATE}/"): file.content
        for file in shipped_files.below(resources.templates() / "firmware" / TEMPLATE, TEMPLATE)
        if not file.path.endswith(".j2")
    }
    texts[CONFIG] = render(f"firmware/{TEMPLATE}/{CONFIG}", **settings.values())
    digest = digest_of_sources(texts)
    texts[VERSION] = render(f"firmware/{TEMPLATE}/{VERSION}", digest=digest)
    texts[f"{name}.ino"] = texts.pop(SKETCH)
    return Sketch(name, tuple(File(f"{name}/{path}", texts[path]) for path in sorted(texts)), digest)


def digest_of_sources(texts: dict[str, bytes]) -> str:
    """Returns a digest that changes with any byte of any file, and with its name."""
    whole = hashlib.sha256()
    for path in sorted(texts):
        whole.update(f"{path}\0{len(texts[path])}\0".encode() + texts[path])
    return whole.hexdigest()[:DIGITS]
