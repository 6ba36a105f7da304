"""A timeline of what happens to an emulated robot: faults, cables, walls. In real or in virtual time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, Protocol

from pydantic import AfterValidator, Field, model_validator

from swarmctl.lab.emulators.faults import Faults
from swarmctl.lab.emulators.robot import Robot
from swarmctl.lab.emulators.settings import change
from swarmctl.lab.emulators.world import Wall
from swarmctl.spec.diagnostics import Diagnostic, has_errors
from swarmctl.spec.source import Source, parse
from swarmctl.spec.validation import validated
from swarmctl.spec.words import Model

ACTIONS = ("fault", "unplug", "plug", "power_cycle", "walls", "place", "set")


def _of(count: int, numbers: str) -> AfterValidator:
    def checked(values: tuple[float, ...]) -> tuple[float, ...]:
        if len(values) != count:
            raise ValueError(f"{count} numbers belong here: {numbers}")
        return values

    return AfterValidator(checked)


WallEnds = Annotated[tuple[float, ...], _of(4, "x1, y1, x2, y2 of a wall, in m")]
Pose = Annotated[tuple[float, ...], _of(3, "x, y (m) and the heading theta (rad)")]


class Target(Protocol):
    """A robot on a line, as ``Port`` and ``VirtualPort`` have it."""

    faults: Faults

    def plug(self) -> Any: ...
    def unplug(self) -> None: ...
    def power_cycle(self) -> None: ...
    def now(self) -> AbstractContextManager[Robot]: ...


class Step(Model):
    """One thing that happens, ``at`` seconds after the start."""

    at: float = Field(ge=0.0, description="Seconds after the start.")
    fault: dict[str, Any] | None = Field(
        None, description="What goes wrong on the line from now on; {} ends it."
    )
    unplug: Literal[True] | None = Field(None, description="The cable is pulled.")
    plug: Literal[True] | None = Field(None, description="The cable is put back.")
    power_cycle: Literal[True] | None = Field(None, description="The robot is switched off and on.")
    walls: tuple[WallEnds, ...] | None = Field(
        None, description="The walls around it from now on, each from x1, y1 to x2, y2, in m."
    )
    place: Pose | None = Field(None, description="The robot is put down at x, y (m), heading theta (rad).")
    set: dict[str, Any] | None = Field(None, description="Settings that change while it runs.")

    @model_validator(mode="after")
    def _does_one_thing(self) -> Step:
        if len(self.actions) != 1:
            found = "nothing" if not self.actions else f"{len(self.actions)} things"
            raise ValueError(f"a step does one thing, this one {found}; one of {', '.join(ACTIONS)}")
        return self

    @property
    def actions(self) -> list[str]:
        return [name for name in ACTIONS if getattr(self, name) is not None]

    def apply(self, target: Target) -> None:
        """Let it happen now."""
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
            raise ValueError("there is no step in this script; one is written: - {at: 2.0, unplug: true}")
        return self


def play(steps: Sequence[Step], target: Target, wait: Callable[[float], Any]) -> None:
    """Let all steps happen, each at its time. ``wait`` lets seconds pass: ``time.sleep``, or the ``advance``
    of a ``VirtualPort``.
    """
    now = 0.0
    for step in steps:
        wait(step.at - now)
        now = step.at
        step.apply(target)


def read_script(path: Path, robot: Robot) -> tuple[tuple[Step, ...], tuple[Diagnostic, ...]]:
    """The steps of a file for ``robot``, in order of time, and what is wrong with them."""
    try:
        text = path.read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        return (), (Diagnostic("FILE001", f"cannot read {path}: {error}"),)
    return script_of(text, str(path), robot)


def script_of(text: str, path: str, robot: Robot) -> tuple[tuple[Step, ...], tuple[Diagnostic, ...]]:
    """The steps of a text for ``robot``, in order of time, and what is wrong with them."""
    source, found = parse(text, path)
    if has_errors(found):
        return (), tuple(found)
    timeline, wrong = validated(Timeline, replace(source, data={"steps": source.data}))
    found = [*found, *wrong]
    if timeline is None:
        return (), tuple(found)
    found += _unfit(timeline.steps, source, robot)
    return tuple(sorted(timeline.steps, key=lambda step: step.at)), tuple(found)


def _unfit(steps: Sequence[Step], source: Source, robot: Robot) -> Iterator[Diagnostic]:
    """Faults and settings that ``robot`` cannot have."""
    for index, step in enumerate(steps):
        action = step.actions[0]
        try:
            if step.fault is not None:
                Faults.of(step.fault).fitting(robot)
            if step.set is not None:
                change(copy(robot), step.set)
        except ValueError as error:
            yield Diagnostic("SPEC003", str(error), source.span((index, action), key=True))
