"""The page of the migration in the lab: each command of each step runs, and the gamepad drives all."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from swarmctl.cli import exit_codes
from tests import ROOT
from tests.e2e.experiment import Experiment
from tests.e2e.lab_needs import skip_without_wheels
from tests.e2e.lab_swarm import LabSwarm, lab_of, until
from tests.loading import load_swarm

PAGE = ROOT / "docs/ros1-to-ros2.md"
BLOCK = re.compile(r"```(yaml|sh)\n(.*?)```", re.DOTALL)
#: It calls the addresses of the spec, and has no lab; tests/remote/test_trust.py runs it.
OUTSIDE = "trust"
STEPS = 5


def steps() -> Iterator[tuple[dict[str, Any], list[list[str]]]]:
    """The spec after each edit of the page, and the commands that follow it."""
    spec: dict[str, Any] = {}
    for kind, text in BLOCK.findall(PAGE.read_text("utf-8")):
        if kind == "yaml":
            edit = yaml.safe_load(text)
            spec = {**spec, **edit}
            if spec["mode"] == "combined":
                spec.pop("hub", None)
            else:
                spec.pop("islands", None)
        else:
            commands = [shlex.split(line) for line in text.splitlines()]
            assert all(words[:1] == ["swarmctl"] and "swarm.yaml" in words for words in commands)
            yield spec, [[one for one in words[1:] if one != "swarm.yaml"] for words in commands]


def distros(file: Path) -> dict[str, str]:
    swarm, found = load_swarm(file)
    assert swarm is not None, found
    return {host: swarm.distro_of(host) for host in swarm.hosts}


def test_each_step_is_valid_and_moves_the_hosts_that_the_page_names(tmp_path: Path) -> None:
    moved, before = [], {"koala-laptop": "noetic", "k3-pi": "noetic", "epuck-pi": "noetic"}
    for number, (spec, _) in enumerate(steps()):
        file = tmp_path / f"{number}.yaml"
        file.write_text(yaml.safe_dump(spec, sort_keys=False))
        after = distros(file)
        moved.append([host for host in after if after[host] != before[host]])
        before = after
    assert moved == [[], [], ["k3-pi"], ["epuck-pi"], ["koala-laptop"]]


@pytest.mark.parametrize("number", [2, *(pytest.param(one, marks=pytest.mark.slow) for one in (0, 3, 4))])
def test_every_command_of_a_step_succeeds_and_the_gamepad_drives_all(number: int, workplace: Path) -> None:
    """Step 1 runs in the lab of the step before: its hosts stay as they are."""
    every = list(steps())
    assert len(every) == STEPS
    folder = workplace / f"step-{number}"
    folder.mkdir()
    file = folder / "page.yaml"
    write(file, every[number][0])
    skip_without_wheels(file)
    with lab_of(f"step{number}-{os.getpid()}", file, folder) as lab:
        run(lab, every[number][1])
        if number == 0:
            write(lab.spec, every[1][0])
            run(lab, every[1][1])
        swarm, _ = load_swarm(lab.spec)
        assert swarm is not None
        until(lambda: lab.swarmctl("status").status == exit_codes.OK, lambda: lab.swarmctl("status").out)
        experiment = Experiment(lab, swarm, {})
        with experiment.gamepad() as pad:
            experiment.drives(pad, "koala", "k3", "epuck")
            pad.let_go()
            experiment.seconds_to_rest()


def write(file: Path, spec: dict[str, Any]) -> None:
    """Writes the spec without the gamepad's node: the lab lacks its package, and `prepare` finds none."""
    programs = {name: one for name, one in spec["programs"].items() if name != "gamepad"}
    file.write_text(yaml.safe_dump({**spec, "programs": programs}, sort_keys=False))


def run(lab: LabSwarm, commands: list[list[str]]) -> None:
    for verb, *options in commands:
        if verb == OUTSIDE:
            continue
        if verb == "status":
            until(lambda: lab.swarmctl("status").status == exit_codes.OK, lambda: lab.swarmctl("status").out)
        elif verb in ("validate", "graph"):
            assert lab.run(verb, str(lab.spec), *options).status == exit_codes.OK
        else:
            yes = ["--yes"] if verb in ("deploy", "prepare") else []
            done = lab.swarmctl(verb, *options, *yes)
            assert done.status == exit_codes.OK, (verb, options, done.out + done.err)
