"""Scripts of events for an emulated robot (faults, cables, walls), in real or virtual time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, Protocol

from pydantic import AfterValidator, Field, model_validator

from swarmctl.diagnostics import Diagnostic, has_errors
from swarmctl.field_types import Model
from swarmctl.lab.emulators.differential_drive import Wall
from swarmctl.lab.emulators.emulator_settings import change
from swarmctl.lab.emulators.robot import Robot
from swarmctl.lab.emulators.serial_faults import Faults
from swarmctl.spec.validation import validated
from swarmctl.yamltext.source import Source, parse

ACTIONS = ("fault", "unplug", "plug", "power_cycle", "walls", "place", "set")


def _of(count: int, numbers: str) -> AfterValidator:
    def checked(values: tuple[float, ...]) -> tuple[float, ...]:
        if len(values) != count:
            raise ValueError(f"expected {count} numbers: {numbers}")
        return values

    return AfterValidator(checked)


WallEnds = Annotated[tuple[float, ...], _of(4, "x1, y1, x2, y2 of a wall, in m")]
Pose = Annotated[tuple[float, ...], _of(3, "x, y (m) and the heading theta (rad)")]


class Target(Protocol):
    """A robot on a line: ``Port`` or ``VirtualPort``."""

    faults: Faults

    def plug(self) -> Any:
        """Connects the cable."""

    def unplug(self) -> None:
        """Disconnects the cable."""

    def power_cycle(self) -> None:
        """Switches the robot off and on."""

    def now(self) -> AbstractContextManager[Robot]:
        """Yields the robot at the present moment, locked."""


class Step(Model):
    """One event, ``at`` seconds after the start."""

    at: float = Field(ge=0.0, description="Seconds after the start.")
    fault: dict[str, Any] | None = Field(
        None, description="The faults of the line from now on; {} ends them."
    )
    unplug: Literal[True] | None = Field(None, description="The cable is disconnected.")
    plug: Literal[True] | None = Field(None, description="The cable is connected.")
    power_cycle: Literal[True] | None = Field(None, description="The robot is switched off and on.")
    walls: tuple[WallEnds, ...] | None = Field(
        None, description="The walls from now on, each from x1, y1 to x2, y2, in m."
    )
    place: Pose | None = Field(None, description="The robot is moved to x, y (m), heading theta (rad).")
    set: dict[str, Any] | None = Field(None, description="Settings that change while it runs.")

    @model_validator(mode="after")
    def _does_one_thing(self) -> Step:
        if len(self.actions) != 1:
            raise ValueError(
                f"a step has one action, this one {len(self.actions)}; one of {', '.join(ACTIONS)}"
            )
        return self

    @property
    def actions(self) -> list[str]:
        """The names of the actions of this step."""
        return [name for name in ACTIONS if getattr(self, name) is not None]

    def apply(self, target: Target) -> None:
        """Applies the event."""
        if self.fault is not None:
            target.faults = Faults.of(self.fault)
        elif self.unplug:
            target.unplug()
        elif self.plug:
            target.plug()
        elif self.power_cycle:
            target.power_cycle()
        else:
            with target.now() as robot:
                self._change(robot)

    def _change(self, robot: Robot) -> None:
        if self.walls is not None:
            robot.walls = tuple(Wall(*wall) for wall in self.walls)
        if self.place is not None:
            robot.chassis.place(*self.place)
        if self.set is not None:
            change(robot, self.set)


class Timeline(Model):
    """The whole file: a list of steps."""

    steps: tuple[Step, ...]

    @model_validator(mode="after")
    def _has_steps(self) -> Timeline:
        if not self.steps:
            raise ValueError("this script has no step; write for example: - {at: 2.0, unplug: true}")
        return self


def play(steps: Sequence[Step], target: Target, wait: Callable[[float], Any]) -> None:
    """Applies all steps, each at its time.

    ``wait``: ``time.sleep`` or ``VirtualPort.advance``.
    """
    now = 0.0
    for step in steps:
        wait(step.at - now)
        now = step.at
        step.apply(target)


def read_script(path: Path, robot: Robot) -> tuple[tuple[Step, ...], tuple[Diagnostic, ...]]:
    """Returns the steps of a file for ``robot``, in order of time, and their diagnostics."""
    try:
        text = path.read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        return (), (Diagnostic("FILE001", f"cannot read {path}: {error}"),)
    return script_of(text, str(path), robot)


def script_of(text: str, path: str, robot: Robot) -> tuple[tuple[Step, ...], tuple[Diagnostic, ...]]:
    """Returns the steps of a text for ``robot``, in order of time, and their diagnostics."""
    source, found = parse(text, path)
    if has_errors(found):
        return (), tuple(found)
    timeline, wrong = validated(Timeline, replace(source, data={"steps": source.data}))
    found = [*found, *wrong]
    if timeline is None:
        return (), tuple(found)
    found += _unsupported(timeline.steps, source, robot)
    return tuple(sorted(timeline.steps, key=lambda step: step.at)), tuple(found)


def _unsupported(steps: Sequence[Step], source: Source, robot: Robot) -> Iterator[Diagnostic]:
    """Yields a diagnostic for each fault or setting that ``robot`` does not support."""
    for index, step in enumerate(steps):
        action = step.actions[0]
        try:
            if step.fault is not None:
                Faults.of(step.fault).checked(uses_rosserial=robot.uses_rosserial)
            if step.set is not None:
                change(copy(robot), step.set)
        except ValueError as error:
            yield Diagnostic("SPEC003", str(error), source.span((index, action), key=True))
