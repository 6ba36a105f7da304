"""The sketch of one board: the files of a firmware template, with the robot's wiring and numbers in `config.h`."""

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
class WheelPins:
    """Where one motor and its encoder are wired to, and the PWM (of 255) below which that motor does not turn."""

    encoder: int
    enable: int
    forward: int
    backward: int
    pwm_min: float


@dataclass(frozen=True)
class FirmwareSettings:
    """All that a sketch is told. Speeds are those of a wheel on the ground, m/s; gains are steps of PWM per rad/s
    and per rad of a wheel; the rate is in Hz, times in seconds.
    """

    left: WheelPins = field(default=WheelPins(2, 5, 7, 8, 60.0))
    right: WheelPins = field(default=WheelPins(3, 6, 11, 12, 60.0))
    baud: int = 57600
    command_topic: str = "cmd_vel"
    left_ticks_topic: str = "lwheel"
    right_ticks_topic: str = "rwheel"
    ticks_rate: float = 10.0
    wheel_radius: float = 0.0325
    wheel_separation: float = 0.13
    pulses_per_turn: int = 20
    wheel_speed_max: float = 0.5
    full_speed: float = 0.6
    brake: bool = True
    control_period: float = 0.02
    kp: float = 5.0
    ki: float = 25.0
    dead_man: float = 0.4


@dataclass(frozen=True)
class Sketch:
    """The source of a firmware, and the digest by which the board names it."""

    files: tuple[File, ...]
    digest: str


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
    return Sketch(tuple(File(f"{name}/{path}", texts[path]) for path in sorted(texts)), digest)


def digest_of_sources(texts: dict[str, bytes]) -> str:
    """A digest that changes with any byte of any file, and with its name."""
    whole = hashlib.sha256()
    for path in sorted(texts):
        whole.update(f"{path}\0{len(texts[path])}\0".encode() + texts[path])
    return whole.hexdigest()[:DIGITS]
