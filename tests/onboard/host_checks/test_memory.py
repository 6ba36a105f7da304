from __future__ import annotations

from swarm_onboard.agent.release_store import Home
from swarm_onboard.host_checks.memory import Seen, judge, observe


def test_it_is_that_of_the_kernel() -> None:
    (found,) = observe(Home("new"))
    assert 0 < found.available <= found.size
    assert judge(found._replace(available=found.size), "pi").state == "ok"


def test_little_memory_is_a_warning() -> None:
    found = judge(Seen(512 << 20, 20 << 20), "pi")
    assert (found.state, "20 MiB available of 512 MiB" in found.message) == ("warning", True)
