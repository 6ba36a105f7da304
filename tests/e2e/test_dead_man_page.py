"""The page of the dead-man, read without a lab."""

from __future__ import annotations

from tests.e2e.dead_man import Page
from tests.e2e.test_dead_man import FAULTS, GHOSTS, late


def test_the_page_knows_every_fault_and_its_figures_keep_its_bounds() -> None:
    page = Page()
    assert page.faults == (*FAULTS, GHOSTS)
    for fault in page.faults:
        assert late(page.stops(fault), page.bound(fault)) == {}, fault
