"""Who is obeyed: whatever anybody sends and whenever, at most one sender, and only a declared one."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.command.authority import Authority, Commander, Sender, Standing

TIMEOUT = 0.5
LAPTOP, PI, STRANGE = "192.168.77.10", "192.168.77.11", "192.168.77.12"
JOYSTICK = Commander("joystick", 7, nodes=("/joystick",), hosts=(LAPTOP,))
LEADER = Commander("laptop", 0, addresses=(LAPTOP,))
OWN = Commander("k3-pi", -1, namespace="/k3", hosts=(PI, STRANGE), addresses=(PI,))
ALL = (LEADER, OWN, JOYSTICK)  # an arbiter puts them in order itself

NOT_AMONG = "not among its commanders joystick, laptop, k3-pi"
OTHERWISE = "(known as 192.168.77.10, 192.168.77.11: was it started with another ROS_IP?)"

SENDERS = {
    Sender("/joystick", LAPTOP): 7,
    Sender("/joystick", ""): 7,
    Sender("/joystick", PI): -1,
    Sender("/rostopic_1", LAPTOP): 0,
    Sender("/rostopic_2", LAPTOP): 0,
    Sender("/k3/wander", STRANGE): -1,
    Sender("/wander", PI): -1,
    Sender("/rostopic_3", STRANGE): None,
    Sender("/rostopic_4", None): None,
    Sender("/joystick", STRANGE): None,
    Sender("/joystick", None): None,
    Sender("/k3/wander", None): None,
    Sender("/k3", None): None,
    Sender("/k30/wander", STRANGE): None,
}
MOMENTS = st.lists(st.tuples(st.sampled_from(list(SENDERS)), st.floats(0.0, 0.7)), max_size=60)


def history(steps: list[tuple[Sender, float]]) -> list[tuple[float, Sender, bool]]:
    """When who sent, and whether that was taken."""
    authority, now, found = Authority(ALL, TIMEOUT), 0.0, []
    for sender, pause in steps:
        now += pause
        found.append((now, sender, authority.admits(sender, now)))
    return found


@given(MOMENTS)
def test_undeclared_senders_are_never_obeyed(steps):
    assert not any(taken and SENDERS[sender] is None for _, sender, taken in history(steps))


@given(MOMENTS)
def test_at_any_moment_at_most_one_sender_is_obeyed(steps):
    """Another one of the same or a lower priority comes in only once the one before has been silent."""
    taken = [(now, sender) for now, sender, ok in history(steps) if ok]
    for (before, first), (now, second) in pairwise(taken):
        if first.node != second.node and SENDERS[second] <= SENDERS[first]:
            assert now >= before + TIMEOUT


@given(MOMENTS)
def test_the_highest_commander_is_never_refused(steps):
    assert all(taken for _, sender, taken in history(steps) if SENDERS[sender] == 7)


@given(MOMENTS)
def test_nobody_is_obeyed_while_a_higher_commander_sends(steps):
    sent: dict[int, float] = {}
    for now, sender, taken in history(steps):
        priority = SENDERS[sender]
        if taken:
            assert all(now >= at + TIMEOUT for one, at in sent.items() if one > priority)
        if priority is not None:
            sent[priority] = now


@given(MOMENTS)
def test_who_sends_alone_is_obeyed(steps):
    """After a silence the first declared sender is taken, whatever was before."""
    found = history(steps)
    authority = Authority(ALL, TIMEOUT)
    for now, sender, _ in found:
        authority.admits(sender, now)
    later = (found[-1][0] if found else 0.0) + TIMEOUT
    for sender, priority in SENDERS.items():
        if priority is not None:
            assert authority.admits(sender, later)
            later += TIMEOUT


def test_no_number_of_senders_fills_the_memory():
    authority = Authority(ALL, TIMEOUT)
    for number in range(10_000):
        authority.admits(Sender(f"/stranger_{number}", STRANGE), number / 1000)
        authority.admits(Sender(f"/anonymous_{number}", LAPTOP), number / 1000)
    assert len(authority._refused) <= 16
    assert len(authority._holds) <= len(ALL)
    standing = authority.standing(10.0)
    assert len(standing.refused) < 400
    assert len(standing.refused_nodes) <= 190
    assert standing.refused_nodes.split()[-1] == "more"


def test_refused_nodes_are_whole_names():
    authority = Authority(ALL, TIMEOUT)
    for node in ("/x2", "/a/x", "/x"):
        authority.admits(Sender(node, STRANGE), 1.0)
    assert authority.standing(2.0).refused_nodes == "/x /a/x /x2"
    authority.admits(Sender("/x /boss", STRANGE), 2.0)
    assert authority.standing(2.0).refused_nodes == "/x /a/x /x2 more"
    assert authority.standing(70.0).refused_nodes == ""


@pytest.mark.parametrize(
    ("sender", "taken", "complaint"),
    [
        (Sender("/joystick", LAPTOP), True, ""),
        (Sender("/rostopic_1", LAPTOP), True, ""),
        (Sender("/k3/wander", STRANGE), True, ""),
        (
            Sender("/joystick", STRANGE),
            False,
            f"refuses /joystick on {STRANGE}: it has the name of a node of joystick, which is on {LAPTOP}",
        ),
        (
            Sender("/rostopic_77", STRANGE),
            False,
            f"refuses /rostopic_77 on 192.168.77.12: {NOT_AMONG}",
        ),
        (
            Sender("/rostopic_77", "koala-laptop"),
            False,
            f"refuses /rostopic_77 on koala-laptop: {NOT_AMONG} {OTHERWISE}",
        ),
        (
            Sender("/rostopic_77", "127.0.0.1"),
            False,
            f"refuses /rostopic_77 on 127.0.0.1: {NOT_AMONG} {OTHERWISE}",
        ),
        (
            Sender("/rostopic_77", ""),
            False,
            f"refuses /rostopic_77: {NOT_AMONG}",
        ),
        (
            Sender("/rostopic_77", None),
            False,
            "refuses /rostopic_77: its host is not known",
        ),
    ],
)
def test_a_refusal_names_the_sender_and_the_reason(sender, taken, complaint):
    authority = Authority(ALL, TIMEOUT)
    assert authority.admits(sender, 1.0) is taken
    assert authority.standing(1.0).complaint == complaint


def test_the_standing_names_the_commander_until_its_timeout():
    authority = Authority(ALL, TIMEOUT)
    assert authority.standing(0.0) == Standing("nobody", "none", "")
    authority.admits(Sender("/rostopic_1", LAPTOP), 1.0)
    assert authority.standing(1.49).commander == "laptop (/rostopic_1)"
    authority.admits(Sender("/joystick", LAPTOP), 1.4)
    assert authority.standing(1.49).commander == "joystick (/joystick)"
    assert authority.standing(1.9).commander == "nobody"


@pytest.mark.parametrize(
    ("age", "reason"), [(0.6, "0.6 s old by its stamp"), (-0.6, "0.6 s ahead of time by its stamp")]
)
def test_an_old_command_is_none(age: float, reason: str):
    authority = Authority(ALL, TIMEOUT)
    assert not authority.admits(Sender("/joystick", LAPTOP), 1.0, age)
    standing = authority.standing(1.0)
    assert standing.complaint.startswith(f"refuses /joystick on {LAPTOP}: its command was {reason}: check")
    assert (standing.commander, standing.strangers) == ("nobody", "")
    assert authority.admits(Sender("/rostopic_1", LAPTOP), 1.1), "it does not hold the robot"
    assert authority.admits(Sender("/joystick", LAPTOP), 1.2, age / 2)
    assert authority.standing(1.2).complaint == ""
    assert not authority.admits(Sender("/stranger", STRANGE), 1.3, age)
    assert NOT_AMONG in authority.standing(1.3).strangers


def test_a_waiting_second_node_still_holds_lower_commanders_back():
    """Otherwise a lower one would slip in between the two."""
    authority = Authority(ALL, TIMEOUT)
    assert authority.admits(Sender("/rostopic_1", LAPTOP), 1.0)
    assert not authority.admits(Sender("/rostopic_2", LAPTOP), 1.25)
    assert not authority.admits(Sender("/k3/wander", PI), 1.5)
    assert authority.standing(1.5).commander == "nobody"
    assert authority.admits(Sender("/rostopic_2", LAPTOP), 1.51)


def test_who_waits_its_turn_is_named_and_no_reason_to_warn():
    authority = Authority(ALL, TIMEOUT)
    authority.admits(Sender("/joystick", LAPTOP), 1.0)
    authority.admits(Sender("/rostopic_1", LAPTOP), 1.1)
    authority.admits(Sender("/rostopic_1", LAPTOP), 1.2)
    standing = authority.standing(1.3)
    assert standing.refused == "/rostopic_1 on 192.168.77.10 (2 commands): behind joystick (/joystick)"
    assert standing.strangers == ""  # it may command, only not now
    assert standing.complaint == ""
    assert authority.admits(Sender("/rostopic_1", LAPTOP), 1.5)
    assert authority.standing(1.5).refused == "none"


def test_a_commander_that_is_silent_after_stops_releases_the_robot():
    authority = Authority(ALL, TIMEOUT)
    joystick, program = Sender("/joystick", LAPTOP), Sender("/rostopic_1", LAPTOP)
    for number in range(3):
        assert authority.admits(joystick, 1.0 + number / 10)
        assert not authority.admits(program, 1.05 + number / 10)
    assert not authority.admits(program, 1.69)
    assert authority.admits(program, 1.7)


def test_a_stranger_with_a_commanders_name_is_reported_beside_it():
    authority = Authority(ALL, TIMEOUT)
    assert not authority.admits(Sender("/joystick", STRANGE), 1.0)
    assert authority.admits(Sender("/joystick", LAPTOP), 1.1)
    assert authority.standing(1.2).strangers.startswith("/joystick on 192.168.77.12 (1 command): it has")
    assert authority.standing(1.2).commander == "joystick (/joystick)"


def test_a_stranger_is_reported_while_it_sends_then_forgotten():
    authority = Authority(ALL, TIMEOUT)
    authority.admits(Sender("/rostopic_3", STRANGE), 1.0)
    assert authority.standing(5.9).complaint
    assert authority.standing(6.1).complaint == ""
    assert authority.standing(6.1).refused.startswith("/rostopic_3 on 192.168.77.12 (1 command): not among")
    assert "not among its commanders" in authority.standing(60.9).strangers
    assert (authority.standing(61.1).refused, authority.standing(61.1).strangers) == ("none", "")


def test_a_robot_without_commanders_obeys_nobody():
    authority = Authority((), TIMEOUT)
    assert not authority.admits(Sender("/joystick", LAPTOP), 1.0)
    assert authority.standing(1.0).complaint == "refuses /joystick on 192.168.77.10: nobody may command it"
