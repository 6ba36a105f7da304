"""The parameters that differ from trial to trial: combinations of them, as overlays of the spec. Pure."""

from __future__ import annotations

import json
from collections.abc import Mapping
from itertools import product
from typing import Any

from swarmctl.spec.experiment_model import Experiment
from swarmctl.spec.model import Spec

Values = Mapping[str, Mapping[str, Any]]  # by program and parameter


def combinations(experiment: Experiment) -> list[Values]:
    """Returns each combination of the values in `parameters`, the last one changing first; one without any.

    Trial n, from 1 on, has number (n - 1) modulo their count: what changes with time, such as a battery,
    affects all alike.
    """
    places = [(program, key) for program, keys in experiment.parameters.items() for key in keys]
    found: list[Values] = []
    for values in product(*(experiment.parameters[program][key] for program, key in places)):
        one: dict[str, dict[str, Any]] = {}
        for (program, key), value in zip(places, values, strict=True):
            one.setdefault(program, {})[key] = value
        found.append(one)
    return found


def overlay(values: Values, spec: Spec) -> str:
    """Returns the overlay that gives programs of ``spec`` these values, in JSON, which is YAML."""
    programs = {name: {spec.programs[name].named_values[0]: own} for name, own in values.items()}
    return json.dumps({"programs": programs}, indent=1, ensure_ascii=False) + "\n"
