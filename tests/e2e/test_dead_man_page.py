"""The page of the dead-man, read without a lab."""

from __future__ import annotations

from tests.e2e.dead_man import Page
from tests.e2e.test_dead_man import FAULTS, GHOSTS, SPEEDS


def test_the_page_knows_every_fault_and_its_figures_keep_its_bounds() -> None:
    page = Page()
    assert page.faults == (*FAULTS, GHOSTS)
    for fault in page.faults:
        bound = page.bound(fault)
        for robot, stop in page.stops(fault).items():
            assert stop.seconds <= bound, (fault, robot)
            assert stop.metres <= bound * SPEEDS[robot], (fault, robot)
