"""The sketch of one board: a firmware template, with the robot's wiring and numbers in `config.h`."""

from __future__ import annotations

import hashlib
from dataclasses import asdict, dataclass, field

from swarmctl.render import shipped
from swarmctl.render.bundle import File
from swarmctl.render.templates import render

TEMPLATE = "uno-l298n"
CONFIG, VERSION, SKETCH = "config.h", "version.h", "rover.ino"
DIGITS = 12  # of the digest, enough to tell two firmwares of one robot apart


@dataclass(frozen=True)
class WheelSettings:
    """Where one motor and its encoder are wired to; the PWM (of 255) where that motor begins to turn, and
    the speed on the ground that full PWM gives, m/s.
    """

    encoder: int
    enable: int
    forward: int
    backward: int
    pwm_min: float
    full_speed: float


@dataclass(frozen=True)
class FirmwareSettings:
    """All that a sketch is told: lengths in m, times in s, rates in Hz, speeds of a wheel on the ground.

    The gains are steps of PWM per rad/s and per rad of a wheel.
    """

    left: WheelSettings = field(default=WheelSettings(2, 5, 7, 8, 60.0, 0.6))
    right: WheelSettings = field(default=WheelSettings(3, 6, 11, 12, 60.0, 0.6))
    baud: int = 57600
    command_topic: str = "cmd_vel"
    left_ticks_topic: str = "lwheel"
    right_ticks_topic: str = "rwheel"
    ticks_rate: float = 10.0
    wheel_radius: float = 0.0325
    wheel_separation: float = 0.13
    pulses_per_turn: int = 20
    wheel_speed_max: float = 0.5
    acceleration_max: float = 1.0
    brake: bool = True
    control_period: float = 0.02
    kp: float = 8.0
    ki: float = 40.0
    dead_man: float = 0.4


@dataclass(frozen=True)
class Sketch:
    """The source of a firmware, and the digest by which the board names it."""

    name: str
    files: tuple[File, ...]
    digest: str

    @property
    def sources(self) -> dict[str, bytes]:
        """The files by their names in the sketch's folder."""
        return {file.path.removeprefix(f"{self.name}/"): file.content for file in self.files}


def sketch(name: str, settings: FirmwareSettings) -> Sketch:
    """The sketch called ``name``: a folder as the Arduino IDE wants it too, with ``<name>.ino`` in it."""
    values = asdict(settings)
    values |= {side: getattr(settings, side) for side in ("left", "right")}
    texts = {
        file.path.removeprefix(f"{TEMPLATE}/"): file.content
        for file in shipped.folder(f"firmware/{TEMPLATE}", TEMPLATE)
        if not file.path.endswith(".j2")
    }
    texts[CONFIG] = render(f"firmware/{TEMPLATE}/{CONFIG}", **values)
    digest = digest_of_sources(texts)
    texts[VERSION] = render(f"firmware/{TEMPLATE}/{VERSION}", digest=digest)
    texts[f"{name}.ino"] = texts.pop(SKETCH)
    return Sketch(name, tuple(File(f"{name}/{path}", texts[path]) for path in sorted(texts)), digest)


def digest_of_sources(texts: dict[str, bytes]) -> str:
    """A digest that changes with any byte of any file, and with its name."""
    whole = hashlib.sha256()
    for path in sorted(texts):
        whole.update(f"{path}\0{len(texts[path])}\0".encode() + texts[path])
    return whole.hexdigest()[:DIGITS]
