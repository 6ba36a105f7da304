"""The keys of an experiment: what starts with each of its trials, for how long, and what is recorded."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from swarmctl.field_types import Model, Printable, ProgramName, SelectedRobot
from swarmctl.units import Unit


class Experiment(Model):
    """Trials of a deployed swarm, which ``swarmctl run`` repeats."""

    robots: tuple[SelectedRobot, ...] = Field(
        (),
        description="Robots, or selections of them, that stand before and after each trial; by default all.",
        examples=[["koala", "k3"]],
    )
    programs: tuple[ProgramName, ...] = Field(
        (),
        description="Programs that start anew with each trial; the others run on.",
        examples=[["wander"]],
    )
    duration: Annotated[float, Unit("s")] = Field(
        gt=0, le=86_400, description="Time of a trial, after which its robots stop.", examples=[60.0]
    )
    trials: int = Field(1, ge=1, le=1000, description="How many trials.", examples=[10])
    record: tuple[Printable, ...] = Field(
        ("*",),
        description="Topics to record, as `swarmctl record` takes them; by default all.",
        examples=[["*/odom", "/tf"]],
    )
