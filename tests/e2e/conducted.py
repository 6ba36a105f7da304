"""What holds for every experiment of the paper, whatever its ROS: a base of classes of tests."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from swarmctl.capsule import folder as capsules
from swarmctl.cli import exit_codes
from tests.e2e import trials
from tests.e2e.bags import forget
from tests.e2e.experiment import EXAMPLES, STILL, Experiment, conducted
from tests.e2e.lab_needs import skip_without_wheels
from tests.e2e.lab_swarm import LabSwarm, Note, until
from tests.timing import Promise


class Conducted:
    """What holds for every experiment. ``EXAMPLE`` is its folder, ``FOLLOWERS`` the robots of the gamepad."""

    EXAMPLE: str
    FOLLOWERS: tuple[str, ...]

    @pytest.fixture(scope="class")
    @classmethod
    def experiment(cls, workplace: Path) -> Iterator[Experiment]:
        skip_without_wheels(EXAMPLES / cls.EXAMPLE / "swarm.yaml")
        with conducted(cls.EXAMPLE, workplace, cls.prepare) as done:
            yield done

    @classmethod
    def prepare(cls, swarm: LabSwarm) -> None:
        """What a person does to the hosts before the first deploy."""

    def test_is_deployed_and_healthy(self, experiment: Experiment, note: Note) -> None:
        for what, seconds in experiment.seconds.items():
            note(f"{self.EXAMPLE}: {what}", f"{seconds:.1f} s", "")
        assert experiment.lab.plan().status == exit_codes.OK  # nothing is left to do

    def test_the_graph_has_just_what_the_spec_says(self, experiment: Experiment) -> None:
        experiment.settles()

    def test_status_says_that_the_joystick_waits_until_a_gamepad_is_there(
        self, experiment: Experiment
    ) -> None:
        waits = experiment.lab.findings()["program joystick"]
        assert waits["state"] == "warning"
        assert waits["message"].startswith("waits for the joystick: no message on `joy` ")
        with experiment.gamepad():
            until(lambda: "program joystick" not in experiment.lab.findings(), "it still waits")

    def test_the_gamepad_drives_its_robots_and_no_others(
        self, experiment: Experiment, note: Note, promise: Promise
    ) -> None:
        with experiment.gamepad() as pad:
            took = experiment.drives(pad, *self.FOLLOWERS)
            pad.let_go()
            rest = experiment.seconds_to_rest()
        note(f"{self.EXAMPLE}: button held until all move", f"{took:.2f} s", "")
        promise(f"{self.EXAMPLE}: button let go until all stand", rest, STILL)


class Tried(Conducted):
    """An experiment that the spec has under `experiments`."""

    TRIAL = 10  # s; a minute in the example

    def test_trials_start_with_the_button_held_and_are_kept(
        self, experiment: Experiment, tmp_path: Path, note: Note
    ) -> None:
        spec = trials.shortened(experiment, self.TRIAL)
        place = trials.place_of(self.EXAMPLE, tmp_path)
        try:
            with experiment.gamepad() as pad:
                time.sleep(0.2)  # the joystick wants to see the button free first
                pad.hold(1.0, 0.3)
                for number in trials.numbers():
                    capsule = trials.trial(experiment, spec, number, place)
                    assert capsules.problems(capsule) == ()
                    index = capsules.read(capsule)
                    assert {one.state for one in index.robots.values()} == {"stands"}
                    assert index.robots.keys() >= set(self.FOLLOWERS)
                    trials.shows_its_start(experiment, capsule, self.FOLLOWERS)
                    assert index.success is True
                    assert index.skew is not None
                    assert index.skew < index.seconds
                    note(f"{self.EXAMPLE}: skew of trial {number}", f"{index.skew * 1e3:.1f} ms", "")
                    assert experiment.lab.swarmctl("start").status == exit_codes.OK
        finally:
            forget(experiment.lab)
            experiment.lab.swarmctl("start")
