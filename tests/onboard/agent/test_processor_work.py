"""What a host reports of the work of its processors."""

from __future__ import annotations

import os

from swarm_onboard.agent.processes import Work, processor_work


def test_the_share_of_work_needs_some_time() -> None:
    before = processor_work()
    assert processor_work().since(before) is None


def test_the_busiest_processes_are_named() -> None:
    before, passed = processor_work(), 1000 * (os.cpu_count() or 1)
    worked = dict(zip(sorted(before.processes), (passed // 2, 0, passed // 5), strict=False))
    after = {pid: (name, done + worked.get(pid, 0)) for pid, (name, done) in before.processes.items()}
    after[1 << 30] = "new", 9
    seen = Work(before.busy + passed * 3 // 4, before.all + passed, after).since(before)
    assert seen is not None
    assert (seen.busy, round(seen.own, 3)) == (0.75, 0.7)
    first, _, third = list(worked)
    assert seen.busiest[:2] == [f"{before.processes[pid][0]} ({pid})" for pid in (first, third)]
