"""The trajectories and speeds of robots in trials, drawn by matplotlib."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO

import matplotlib as mpl
from matplotlib.figure import Figure

from swarmctl.capsule.trajectory import Sample

_LONGEST = 60  # characters of a name


def plot(robots: Mapping[str, Sequence[Sequence[Sample]]], form: str) -> bytes:
    """Returns a figure in this format, ``svg`` or ``png``, of trials by the topic of a robot's odometry.

    ``t`` is in s since the trial began. The names are printable.
    """
    figure = Figure(figsize=(12, 6), layout="constrained")
    path, speed = figure.subplots(1, 2)
    colours = mpl.colormaps["tab10" if len(robots) <= 10 else "turbo"].resampled(max(10, len(robots)))
    for number, (name, trials) in enumerate(robots.items()):
        # A name is drawn as it is: `$` begins no formula, and no letter is missing in the font.
        label = name.encode("ascii", "backslashreplace").decode()[:_LONGEST].replace("$", r"\$")
        for trial in trials:
            drawn = {"color": colours(number), "linewidth": 1, "label": label}
            path.plot([one.x for one in trial], [one.y for one in trial], **drawn)
            driven = [(one.t, one.speed) for one in trial if one.speed is not None]
            speed.plot([one[0] for one in driven], [one[1] for one in driven], **drawn)
            label = ""
    path.set(xlabel="x, m", ylabel="y, m", title="Trajectories, from where each robot stood")
    path.set_aspect("equal", adjustable="box")
    speed.set(xlabel="time of the trial, s", ylabel="speed, m/s", title="Speeds")
    figure.legend(*path.get_legend_handles_labels(), loc="outside right upper", ncols=1 + len(robots) // 25)
    made = BytesIO()
    figure.savefig(made, format=form)
    return made.getvalue()
