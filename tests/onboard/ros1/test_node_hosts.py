"""The host of a sender: looked up at the master once, without a long wait."""

from __future__ import annotations

import threading

from swarm_onboard.command.authority import Authority, Commander
from swarm_onboard.command.command_gate import CommandGate
from swarm_onboard.command.command_mailbox import CommandMailbox
from swarm_onboard.ros1.node_hosts import NodeHosts

from tests.timing import PATIENCE, wait_for, work_at_most

URI = "http://192.168.77.10:40001/"


class Master:
    """Answers from ``uris``, after ``hangs`` was set if it hangs; counts the lookups."""

    def __init__(self, **uris: str) -> None:
        self.uris = uris
        self.lookups: list[str] = []
        self.answers = threading.Event()
        self.answers.set()
        self.away = False

    def __call__(self, node: str) -> str:
        self.lookups.append(node)
        self.answers.wait(PATIENCE)
        if self.away:
            raise OSError("connection refused")
        return self.uris.get(node, "")


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def test_the_first_request_has_its_answer_and_later_ones_ask_nobody():
    master = Master(a=URI)
    places = NodeHosts(master)
    assert [places.of("a") for _ in range(1000)] == ["192.168.77.10"] * 1000
    assert master.lookups == ["a"]


def test_a_host_is_reported_as_advertised_in_lower_case():
    places = NodeHosts(
        Master(a="http://Koala-Laptop:40001/", b="http://[fd00::1]:1/", c="nonsense", d="http://[/")
    )
    assert [places.of(node) for node in "abcd"] == ["koala-laptop", "fd00::1", None, None]


def test_a_master_that_hangs_delays_only_the_first_command(monkeypatch):
    """It answers after `PATIENCE`, too late for the first one; no later one may wait at all."""
    master = Master(a=URI, b=URI)
    places = NodeHosts(master)
    assert places.of("a")
    master.answers.clear()
    assert places.of("b") is None
    monkeypatch.setattr(places._news, "wait_for", None)
    assert [places.of("b") for _ in range(1000)] == [None] * 1000
    assert places.of("a") == "192.168.77.10"
    master.answers.set()
    assert wait_for(lambda: places.of("b")) == "192.168.77.10"


def test_an_answer_is_renewed_and_holds_until_the_next_one():
    master, clock = Master(a=URI), Clock()
    places = NodeHosts(master, clock)
    assert places.of("a") == "192.168.77.10"
    master.away = True
    clock.now += 11
    assert places.of("a") == "192.168.77.10"
    wait_for(lambda: len(master.lookups) == 2)
    clock.now += 11
    assert places.of("a") == "192.168.77.10"
    master.away, master.uris = False, {"a": "http://192.168.77.12:1/"}
    clock.now += 11
    wait_for(lambda: places.of("a") == "192.168.77.12")


def test_a_node_unknown_to_the_master_is_soon_looked_up_again():
    master, clock = Master(), Clock()
    places = NodeHosts(master, clock)
    assert places.of("a") is None
    master.uris = {"a": URI}
    assert places.of("a") is None
    clock.now += 1
    assert wait_for(lambda: places.of("a"))
    assert len(master.lookups) == 2


def test_ten_thousand_names_are_not_remembered():
    master = Master()
    places = NodeHosts(master)
    for number in range(10_000):
        places.of(f"/rostopic_{number}")
    assert len(places._places) <= 64
    assert places._wanted.qsize() <= 64


def test_names_that_come_once_do_not_push_out_who_goes_on_sending():
    master = Master(a=URI)
    places = NodeHosts(master)
    for number in range(300):
        assert places.of("a") == "192.168.77.10"
        places.of(f"/rostopic_{number}")
    assert master.lookups.count("a") == 1


def test_a_flood_of_refused_commands_costs_microseconds_each():
    gate = CommandGate(
        Authority((Commander("laptop", 0, addresses=("192.168.77.10",)),), 0.5), CommandMailbox()
    )
    with work_at_most(15):  # some 2 us each
        for _ in range(10_000):
            gate.give("/rostopic_1", "192.168.77.12", (0.1, 0, 0), (0, 0, 0), 0.0)


def test_a_command_that_waited_is_as_old_as_it_is():
    """The dead-man counts from its arrival, not from the answer of the master."""
    commands = CommandMailbox()
    gate = CommandGate(Authority((Commander("laptop", 0, addresses=("192.168.77.10",)),), 0.5), commands)
    gate.give("/rostopic_1", "192.168.77.10", (0.1, 0, 0), (0, 0, 0), arrived=12.5)
    assert commands.latest is not None
    assert (commands.latest.velocity.forward, commands.latest.stamp) == (0.1, 12.5)


def test_an_invalid_command_stops_only_if_a_commander_sent_it():
    commands = CommandMailbox()
    gate = CommandGate(Authority((Commander("laptop", 0, addresses=("192.168.77.10",)),), 0.5), commands)
    gate.give("/a", "192.168.77.10", (0.1, 0, 0), (0, 0, 0), 1.0)
    gate.give("/b", "192.168.77.12", (float("nan"), 0, 0), (0, 0, 0), 1.0)
    assert commands.latest is not None
    assert commands.latest.velocity.forward == 0.1
    gate.give("/a", "192.168.77.10", (float("nan"), 0, 0), (0, 0, 0), 1.0)
    assert (commands.latest.velocity.forward, commands.refused) == (0.0, 1)
