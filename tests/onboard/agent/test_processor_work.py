"""What a host reports of the work of its processors."""

from __future__ import annotations

import os

from swarm_onboard.agent.processor_work import Work, work


def test_the_share_of_work_needs_some_time() -> None:
    before = work()
    assert work().share_since(before) is None
    passed = 1000 * (os.cpu_count() or 1)
    assert Work(before.busy + passed * 3 // 4, before.all + passed).share_since(before) == 0.75
