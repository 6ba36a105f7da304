"""The page of the dead-man, read without a lab."""

from __future__ import annotations

import pytest

from tests.e2e.dead_man import ROS_1, ROS_2, Page
from tests.e2e.test_dead_man import GHOSTS, faults_of, late


@pytest.mark.parametrize("ros", [ROS_1, ROS_2])
def test_the_page_knows_every_fault_and_its_figures_keep_its_bounds(ros: str) -> None:
    page = Page(ros)
    assert page.faults == (*faults_of(ros), GHOSTS)
    for fault in page.faults:
        assert late(page.stops(fault), page.bound(fault)) == {}, fault
