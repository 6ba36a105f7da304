"""How looks at a swarm answer to a fault, with a clock that only looks move."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from swarmctl.health.fault_response import PATIENCE, Look, Observer, Response

WELL = Look(healthy=True, causes=())
BROKEN = Look(healthy=False, causes=("device k3: gone",))
WARNED = Look(healthy=True, causes=("clock pi: is 5 s ahead",))
OTHER = Look(healthy=False, causes=("host pi: away", "device k3: gone"))


class Swarm:
    """Looks that take 3 s each; the last is repeated. It notes what was done to the swarm."""

    def __init__(self, *looks: Look) -> None:
        self._looks = iter(looks)
        self._last = looks[-1]
        self.now = 100.0
        self.done: list[str] = []

    def look(self) -> Look:
        self.now += 3.0
        self.done.append("look")
        self._last = next(self._looks, self._last)
        return self._last

    def response(self, line: str, within: float = 10.0) -> Response:
        return Observer(self.look, lambda: self.now).response("a", line, within, self._begin, self._repair)

    def _begin(self) -> None:
        self.done.append("fault")
        self.now += 50.0  # to make it takes time, which is not counted

    def _repair(self) -> None:
        self.done.append("repair")
        self.now += 7.0


def test_a_fault_that_is_named_and_repaired() -> None:
    swarm = Swarm(WELL, BROKEN, BROKEN, WELL)
    found = swarm.response("device k3: ")
    assert swarm.done == ["fault", "look", "look", "repair", "look", "look"]
    assert (found.first, found.detected, found.recovered) == ("device k3: gone", 6.0, 13.0)
    assert found.as_expected


def test_a_fault_that_something_else_stands_before() -> None:
    found = Swarm(OTHER, OTHER, OTHER, OTHER, WELL).response("device k3: ")
    assert (found.first, found.detected, found.as_expected) == ("host pi: away", None, False)


def test_the_line_of_a_fault_that_ends_by_itself_is_kept() -> None:
    found = Swarm(OTHER, WELL).response("device k3: ")
    assert (found.first, found.detected) == ("host pi: away", None)


def test_a_fault_that_nobody_sees() -> None:
    found = Swarm(WELL).response("device k3: ")
    assert (found.first, found.detected, found.recovered) == ("healthy", None, 10.0)


def test_a_fault_that_is_named_too_late() -> None:
    found = Swarm(WELL, WELL, BROKEN, WELL).response("device k3: ", within=7.0)
    assert (found.detected, found.as_expected) == (9.0, False)


def test_a_warning_counts_and_has_to_go() -> None:
    found = Swarm(WARNED, WARNED, WARNED, WELL).response("clock pi: ")
    assert (found.first, found.detected, found.recovered) == ("clock pi: is 5 s ahead", 3.0, 16.0)


def test_a_swarm_that_does_not_recover() -> None:
    swarm = Swarm(BROKEN)
    found = swarm.response("device k3: ")
    assert (found.recovered, found.as_expected) == (None, False)
    assert swarm.done.count("look") == 1 + PATIENCE / 3


def test_a_fault_is_repaired_when_a_look_fails() -> None:
    swarm = Swarm(WELL)

    def looks() -> Iterator[Look]:
        raise KeyboardInterrupt
        yield WELL

    swarm._looks = looks()
    with pytest.raises(KeyboardInterrupt):
        swarm.response("device k3: ")
    assert swarm.done[-1] == "repair"
