"""What a trial needs: a healthy swarm with the release of its spec, and the thresholds of `ready`."""

from __future__ import annotations

import pytest

from swarmctl.health.readiness import Item, Measured, items
from swarmctl.spec.experiment_model import Ready
from tests.health.swarm_values import UNIT, Spoil, with_unit
from tests.health.test_trial_troubles import look

K3 = UNIT["k3"]
NOTHING = Measured({}, {}, {})


def item(what: str, found: list[Item]) -> Item:
    (one,) = [one for one in found if one.what == what]
    return one


def test_a_healthy_swarm_is_ready() -> None:
    found = items(look(), NOTHING, Ready(), ())
    assert all(one.go for one in found)
    assert item("devices", found).text == "3 of 3"


@pytest.mark.parametrize(
    ("spoil", "what", "text"),
    [
        (with_unit(K3, active="failed", sub="failed"), "units", "unit "),
        (lambda answer: answer._replace(release="0" * 16), "release", "release k3-pi: "),
        (lambda answer: answer._replace(clock_ahead=2.0), "clocks", "clock k3-pi: "),
    ],
    ids=["sick", "another release", "another clock"],
)
def test_a_trial_needs_a_healthy_swarm_with_the_spec_and_one_clock(
    spoil: Spoil, what: str, text: str
) -> None:
    found = items(look(spoil), Measured({"hub": (0.0, 0.001), "k3-pi": (0.001, 0.001)}, {}, {}), Ready(), ())
    assert [one.what for one in found if not one.go] == [what]
    assert item(what, found).text.startswith(text)


CLOCKS = {"hub": (0.0, 0.004), "k3-pi": (0.060, 0.004), "epuck-pi": (-0.010, 0.004)}  # 70 ms apart, within 8


@pytest.mark.parametrize(
    ("ready", "measured", "what", "go"),
    [
        (Ready(clocks=0.061), Measured(CLOCKS, {}, {}), "clocks", False),
        (Ready(clocks=0.063), Measured(CLOCKS, {}, {}), "clocks", True),  # it may be within
        (Ready(), Measured(CLOCKS, {}, {}), "clocks", True),
        (Ready(free_mb=500), Measured({}, {"hub": 900_000_000, "k3-pi": 499_000_000}, {}), "disk", False),
        (Ready(free_mb=499), Measured({}, {"hub": 900_000_000, "k3-pi": 499_000_000}, {}), "disk", True),
        (Ready(battery=0.4), Measured({}, {}, {"k3": 0.39, "koala": 0.9}), "batteries", False),
        (Ready(battery=0.4), Measured({}, {}, {"k3": 0.4, "koala": 0.9}), "batteries", True),
        (Ready(battery=0.4), Measured({}, {}, {"k3": None, "koala": 0.9}), "batteries", False),
        (Ready(), Measured({}, {}, {"k3": None, "koala": 0.01}), "batteries", True),
        (Ready(), Measured({}, {}, {"k3": 0.2, "koala": 0.1}, low={"k3": 0.25}), "batteries", False),
        (Ready(), Measured({}, {}, {"k3": 0.25, "koala": 0.1}, low={"k3": 0.25}), "batteries", True),
        (Ready(), Measured({}, {}, {"k3": None, "koala": 0.9}, low={"k3": 0.25}), "batteries", False),
        (Ready(battery=0.1), Measured({}, {}, {"k3": 0.2}, low={"k3": 0.25}), "batteries", True),
        (Ready(clocks=0.1), Measured(CLOCKS, {}, {}, ["pi"]), "hosts", False),
        (Ready(battery=0.1), Measured(CLOCKS, {}, {}, ["pi"]), "hosts", True),
    ],
)
def test_thresholds(ready: Ready, measured: Measured, what: str, go: bool) -> None:
    found = items(look(), measured, ready, ())
    assert item(what, found).go is go
    assert all(one.go for one in found if one.what != what)


def test_who_lacks_what_is_named() -> None:
    measured = Measured(CLOCKS, {"hub": 9_000_000, "k3-pi": 4_000_000}, {"k3": 0.2, "koala": None})
    found = items(look(), measured, Ready(battery=0.5, clocks=0.01, free_mb=100), ())
    assert item("clocks", found).text == ("70 ms between epuck-pi and k3-pi, give or take 8, more than 10")
    assert item("disk", found).text == "4 MB free on k3-pi, less than 100"
    assert item("batteries", found).text == "k3 20% (less than 50%), koala not known"
    by_robot = Measured({}, {}, {"k3": 0.3, "koala": 0.2}, low={"k3": 0.4})
    assert item("batteries", items(look(), by_robot, Ready(), ())).text == "k3 30% (less than 40%), koala 20%"
    doubtful = CLOCKS | {"pi": (0.2, 0.3)}
    assert not item("clocks", items(look(), Measured(doubtful, {}, {}), Ready(clocks=0.061), ())).go
