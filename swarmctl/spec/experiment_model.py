"""The keys of an experiment: what starts with each of its trials, for how long, and what is recorded."""

from __future__ import annotations

from collections.abc import Iterator
from math import prod
from typing import Annotated

from pydantic import Field

from swarmctl.field_types import (
    ConsistencyError,
    GraphName,
    Model,
    Parameter,
    Printable,
    ProgramName,
    SelectedRobot,
    fits_together,
)
from swarmctl.spec.program_model import Megabytes
from swarmctl.units import Unit

_MOST_TRIALS = 100_000


class Goal(Model):
    """A circle on the ground."""

    x: Annotated[float, Unit("m")] = Field(description="Along the x axis of the topic.", examples=[1.0])
    y: Annotated[float, Unit("m")] = Field(description="Along the y axis of the topic.", examples=[0.0])
    within: Annotated[float, Unit("m")] = Field(0.1, gt=0, description="Its radius.", examples=[0.1])


class Criterion(Model):
    """What the messages of one topic show since the start of a trial: all that is written here."""

    topic: GraphName = Field(
        description="A topic, for `success` a recorded one. Poses of odometry count from where the robot "
        "stood at the start.",
        examples=["k3/odom"],
    )
    reached: Goal | None = Field(
        None, description="The robot is there at least once.", examples=[{"x": 1.0, "y": 0.0}]
    )
    distance: Annotated[float, Unit("m")] | None = Field(
        None, gt=0, description="It drives at least so far.", examples=[1.0]
    )
    count: int | None = Field(None, ge=1, description="There are at least so many messages.", examples=[100])

    @fits_together
    def _has_a_condition(self) -> Iterator[ConsistencyError]:
        if self.reached is None and self.distance is None and self.count is None:
            yield ConsistencyError("a criterion needs `reached`, `distance` or `count`")


class Ready(Model):
    """What holds before a trial begins, beside a swarm that is healthy."""

    battery: float | None = Field(
        None, gt=0, le=1, description="Each battery is at least so full.", examples=[0.4]
    )
    clocks: Annotated[float, Unit("s")] | None = Field(
        None, gt=0, description="The clocks of two hosts differ by so much at most.", examples=[0.05]
    )
    free_mb: Annotated[Megabytes, Field(ge=1)] | None = Field(
        None, description="MB that are free on each host, where bags are recorded.", examples=[2000]
    )


class Experiment(Model):
    """Trials of a deployed swarm, which ``swarmctl run`` repeats."""

    robots: tuple[SelectedRobot, ...] = Field(
        (),
        description="Robots, or selections of them, that stand before and after each trial; by default all.",
        examples=[["koala", "k3"]],
    )
    programs: tuple[ProgramName, ...] = Field(
        (),
        description="Programs that start with each trial: those with `lifecycle: trial` end with it, too, "
        "and the others start anew. All else runs on.",
        examples=[["wander"]],
    )
    reset: ProgramName | None = Field(
        None,
        description="A program with `lifecycle: trial` that brings the robots back between two trials.",
        examples=["go-home"],
    )
    duration: Annotated[float, Unit("s")] = Field(
        gt=0, le=86_400, description="Time of a trial, after which its robots stop.", examples=[60.0]
    )
    until: tuple[Criterion, ...] = Field(
        (),
        description="A trial ends before its `duration` once messages show all of this.",
        examples=[[{"topic": "k3/odom", "distance": 1.0}]],
    )
    trials: int = Field(1, ge=1, le=1000, description="How many trials.", examples=[10])
    record: tuple[Printable, ...] = Field(
        ("*",),
        description="Topics to record, as `swarmctl record` takes them; by default all.",
        examples=[["*/odom", "/tf"]],
    )
    parameters: dict[ProgramName, dict[str, Annotated[tuple[Parameter, ...], Field(min_length=1)]]] = Field(
        {},
        description="Values of parameters of programs; a trial is run with each combination of them.",
        examples=[{"wander": {"speed": [0.1, 0.2], "seed": [1, 2, 3]}}],
    )
    success: tuple[Criterion, ...] = Field(
        (),
        description="A trial succeeds if it is completed and its bags show all of this.",
        examples=[[{"topic": "k3/odom", "reached": {"x": 1.0, "y": 0.0}}]],
    )
    ready: Ready = Field(
        default_factory=Ready,
        description="What a trial needs to begin.",
        examples=[{"battery": 0.4, "clocks": 0.05}],
    )

    @fits_together
    def _can_be_run(self) -> Iterator[ConsistencyError]:
        count = prod(len(values) for keys in self.parameters.values() for values in keys.values())
        if count * self.trials > _MOST_TRIALS:
            yield ConsistencyError(
                f"{count} combinations with {self.trials} trials each are more than {_MOST_TRIALS} trials; "
                "leave out values",
                "parameters",
            )
