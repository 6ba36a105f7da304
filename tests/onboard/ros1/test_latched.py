"""Commands that a publisher repeats to whoever connects."""

from __future__ import annotations

from swarm_onboard.ros.latched import Latched


def test_the_first_command_of_a_new_node_counts():
    latched, connection = Latched(()), object()
    assert [latched.repeats("/a", connection) for _ in range(3)] == [False] * 3


def test_what_was_latched_before_is_left_out_once():
    latched, connection = Latched(["/a"]), object()
    assert [latched.repeats("/a", connection) for _ in range(3)] == [True, False, False]


def test_a_node_that_connects_again_repeats_its_last_command():
    latched, first, second = Latched(()), object(), object()
    assert not latched.repeats("/a", first)
    assert latched.repeats("/a", second)
    assert not latched.repeats("/a", second)


def test_many_nodes_cost_no_memory():
    latched = Latched(())
    for number in range(1000):
        assert not latched.repeats(f"/{number}", object())
    assert len(latched._connections) == 64
