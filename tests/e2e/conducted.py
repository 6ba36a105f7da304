"""What holds for every experiment of the paper, whatever its ROS: a base of classes of tests."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
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
