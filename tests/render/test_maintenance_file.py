"""The terms of `maintenance` in a spec, as the agent of a host reads them."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from swarm_onboard.agent import motion_gate
from swarm_onboard.agent.motion_gate import Terms
from swarm_onboard.agent.release_store import home_of

from swarmctl.render.bundle import Bundle
from swarmctl.rulebook import EXAMPLE
from tests.render.rendered import bundle_of


def bundle(folder: Path, **top: object) -> Bundle:
    data = yaml.safe_load(EXAMPLE.read_text("utf-8"))
    for robot in ("koala", "k3"):
        data["robots"][robot] |= {"maintenance": top.pop(robot)} if robot in top else {}
    return bundle_of(folder, yaml.safe_dump({**data, **top}), "koala-laptop")


def read_back(made: Bundle, prefix: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Terms] | None:
    monkeypatch.setenv("SWARM_PREFIX", str(prefix))
    home = home_of(made.swarm)
    for file in made.files:
        if file.path == motion_gate.TERMS_FILE:
            Path(home.current_link).mkdir(parents=True)
            Path(home.current_link, file.path).write_bytes(file.content)
    return motion_gate.terms_of(home)


@pytest.mark.parametrize(
    ("spec", "terms"),
    [
        ({}, {}),
        ({"k3": {"idle": 5.0}}, {}),  # another host's
        ({"maintenance": {"idle": 30.0, "battery": 0.4}}, {"koala": Terms(30.0, 0.4)}),
        (
            {"maintenance": {"idle": 30.0, "battery": 0.4}, "koala": {"battery": 0.0}},
            {"koala": Terms(30.0, 0.0)},
        ),
        ({"maintenance": {"idle": "1 min"}, "koala": {"battery": 0.2}}, {"koala": Terms(60.0, 0.2)}),
        ({"maintenance": {"idle": 30.0}, "koala": {"idle": 0.0}}, {}),
        ({"maintenance": {"idle": 30.0}, "koala": {"docked": False}}, {"koala": Terms(30.0)}),
    ],
)
def test_the_terms_of_a_robot_win_over_those_of_the_swarm(
    spec: dict[str, object], terms: dict[str, Terms], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert read_back(bundle(tmp_path, **spec), tmp_path, monkeypatch) == terms


def test_other_terms_restart_no_unit(tmp_path: Path) -> None:
    before, after = bundle(tmp_path), bundle(tmp_path, maintenance={"idle": 30.0})
    assert before.digest != after.digest
    assert before.manifest["units"] == after.manifest["units"]
