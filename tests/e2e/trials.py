"""Trials of an experiment of the paper, driven with a gamepad: how they are run, and what their bags show.

``SWARM_TRIALS=10 make experiments`` runs so many of each, and keeps the capsules in build/experiments.
"""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

from swarmctl.capsule import folder as capsules
from swarmctl.cli import exit_codes
from swarmctl.spec.experiment_model import Experiment as Declared
from tests import ROOT
from tests.e2e.bags import messages
from tests.e2e.experiment import Experiment
from tests.e2e.lab_swarm import VERB, until
from tests.loading import load_checked

KEPT = ROOT / "build/experiments"
TRIALS = os.environ.get("SWARM_TRIALS", "")

Stamped = list[tuple[str, float, Any]]


def numbers() -> range:
    return range(1, int(TRIALS or 1) + 1)


def place_of(example: str, otherwise: Path) -> Path:
    """The folder of the capsules."""
    return KEPT / example if TRIALS else otherwise


def shortened(experiment: Experiment, seconds: int) -> Path:
    """The spec with trials of so many seconds. It needs no deploy."""
    return experiment.lab.variant("short-trials", ("duration: 60\n", f"duration: {seconds}\n"))


def declared(spec: Path) -> tuple[str, Declared]:
    """The one experiment of a spec, and its name."""
    document, _ = load_checked(spec)
    assert document is not None
    ((name, found),) = document.spec.experiments.items()
    return name, found


def trial(experiment: Experiment, spec: Path, number: int, place: Path) -> Path:
    """Run a trial while commands arrive all the time: robots stand, drive and stand. Gives its capsule."""
    name, wanted = declared(spec)
    robots = set(wanted.robots)
    until(lambda: experiment.moving() >= robots, "before the trial, not all obey")
    run = experiment.lab.begin("run", name, "--trial", str(number), "--out", str(place), "--json", spec=spec)
    try:
        until(lambda: not experiment.moving() & robots, "no trial begins")
        until(lambda: run.poll() is not None or experiment.moving() >= robots, "not all drive in the trial")
        early = run.poll()
        out, err = run.communicate(timeout=VERB)
        assert early is None, err
    finally:
        run.kill()
        run.communicate()
    assert not experiment.moving() & robots, "not all stand after the trial"
    assert run.returncode == exit_codes.OK, err
    (kept,) = json.loads(out)["trials"]
    return Path(kept["capsule"])


def by_topic(capsule: Path) -> Mapping[str, Stamped]:
    """The messages of all bags."""
    found: dict[str, Stamped] = {}
    for bag in sorted((capsule / "bags").iterdir()):
        for one in messages(bag):
            found.setdefault(one[0], []).append(one)
    return found


def shows_its_start(experiment: Experiment, capsule: Path, held: Collection[str]) -> None:
    """Until its host starts the trial, each robot stands; then it drives away.

    Those of ``held`` are commanded in vain before, by the gamepad; a program of the experiment starts anew.
    """
    index, recorded = capsules.read(capsule), by_topic(capsule)
    for name, robot in index.robots.items():
        began = index.hosts[robot.host].began
        assert began is not None
        command = experiment.spec.command_topics[name].topic
        refused = [one for _, stamp, one in recorded[command] if stamp < began]
        in_vain = any(one.linear.x or one.angular.z for one in refused)
        assert in_vain or name not in held, f"{name} is not commanded before"
        poses = list(_poses(recorded[f"{experiment.spec.robots[name].namespace}/odom"]))
        before = {pose for stamp, pose in poses if stamp < began}
        assert len(before) == 1, f"{name} moves before the start, or its bag begins later: {before}"
        assert poses[-1][1] not in before, f"{name} does not move in its bag"


def _poses(odometry: Stamped) -> Iterator[tuple[float, tuple[float, float]]]:
    for _, stamp, message in odometry:
        place = message.pose.pose.position
        yield stamp, (place.x, place.y)
