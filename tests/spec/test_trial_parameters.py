"""The combinations of an experiment's parameters, and the overlay that gives programs their values."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from swarmctl.spec.experiment_model import Experiment
from swarmctl.spec.trial_parameters import combinations, overlay
from tests.loading import load_checked

PROGRAMS = """
programs:
  square: {host: koala-laptop, package: moves, executable: square.py, params: {speed: 0.1, seed: 0}}
  world: {host: koala-laptop, package: moves, launch: world.launch, args: {walls: none}}
"""


def experiment(parameters: dict[str, dict[str, tuple[Any, ...]]]) -> Experiment:
    return Experiment.model_validate({"duration": 5, "parameters": parameters})


def test_each_combination_is_there_once_and_values_alternate() -> None:
    varied = experiment({"square": {"speed": (0.1, 0.2), "seed": (1, 2)}, "world": {"walls": ("none",)}})
    assert combinations(varied) == [
        {"square": {"speed": speed, "seed": seed}, "world": {"walls": "none"}}
        for speed in (0.1, 0.2)
        for seed in (1, 2)
    ]
    assert combinations(experiment({})) == [{}]


@pytest.mark.parametrize("count", [0, 47])
def test_a_trial_has_values_and_their_number_a_limit(count: int) -> None:
    with pytest.raises(ValidationError):
        experiment({"square": dict.fromkeys("abc", tuple(range(count)))})  # 47 to the third: 103 823


TEXTS = st.text(
    st.characters(codec="ascii", exclude_categories=["C"], exclude_characters="{}$"), min_size=1, max_size=20
)
ODD = ("yes", "null", "1e3", "0x10", "~", "on", "1_000", ": ", "# x")
VALUES = st.one_of(
    st.booleans(),
    st.integers(-1000, 1000),
    st.floats(-1e9, 1e9, width=32),
    TEXTS,
    st.sampled_from(ODD),
)


@given(speed=VALUES, walls=st.one_of(TEXTS, st.integers(0, 9)))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
def test_programs_get_exactly_these_values(leader_spec: Path, tmp_path: Path, speed: Any, walls: Any) -> None:
    base, more = tmp_path / "swarm.yaml", tmp_path / "parameters.yaml"
    base.write_text(leader_spec.read_text("utf-8") + PROGRAMS, "utf-8")
    own, _ = load_checked(base)
    assert own is not None
    more.write_text(overlay({"square": {"speed": speed}, "world": {"walls": walls}}, own.spec), "utf-8")
    document, found = load_checked(base, more)
    assert document is not None, found
    programs = document.spec.programs
    assert programs["square"].params == {"speed": speed, "seed": 0}
    assert type(programs["square"].params["speed"]) is type(speed)
    assert programs["world"].args == {"walls": walls}
