"""Two islands of ROS 2 joined by relays: what one publishes arrives on the other once, or not at all."""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Protocol

import pytest

from swarmctl.cli import exit_codes
from tests.e2e.experiment import seconds_to_health
from tests.e2e.lab_needs import skip_without_wheels
from tests.e2e.lab_node import LabNode, lab_node
from tests.e2e.lab_swarm import LabSwarm, Note, lab_of, until

SPEC = Path(__file__).with_name("two-islands.yaml")
EAST, WEST = "east-pi", "west-pi"
UNIT = "swarm-newswarm.multimaster"
RATE, SAMPLES = 20.0, 100  # of the sensor; Hz
LOST = 0.1  # the share of samples that best effort may lose on a busy machine
PLAIN, LATCHED, SENSOR = {"/chat": "plain"}, {"/map_name": "latched"}, {"/bumps": "sensor"}


class Starts(Protocol):
    """Starts a node on a host."""

    def __call__(
        self,
        host: str,
        name: str,
        publishes: Mapping[str, str] = ...,
        subscribes: Mapping[str, str] = ...,
    ) -> LabNode: ...


@pytest.fixture(scope="module")
def lab(workplace: Path) -> Iterator[LabSwarm]:
    """Two hosts, each of which is an island, deployed and healthy."""
    skip_without_wheels(SPEC)
    folder = workplace / "relay"
    folder.mkdir()
    with lab_of(f"relay-{os.getpid()}", SPEC, folder) as swarm:
        run = swarm.deploy()
        assert run.status == exit_codes.OK, run.out + run.err
        seconds_to_health(swarm)
        yield swarm


@pytest.fixture
def start(lab: LabSwarm) -> Iterator[Starts]:
    with ExitStack() as stack:

        def started(
            host: str, name: str, publishes: Mapping[str, str] = {}, subscribes: Mapping[str, str] = {}
        ) -> LabNode:
            return stack.enter_context(lab_node(lab, host, name, publishes, subscribes))

        yield started


def test_a_topic_of_both_islands_makes_no_loop(start: Starts) -> None:
    """Each message arrives once, and does not come back."""
    nodes = {"east": start(EAST, "east", PLAIN, PLAIN), "west": start(WEST, "west", PLAIN, PLAIN)}
    nodes["east"].reaches(nodes["west"], "/chat")
    nodes["west"].reaches(nodes["east"], "/chat")
    sent = [(name, f"{name} {number}") for number in range(20) for name in nodes]
    for name, text in sent:
        nodes[name].publish("/chat", text)
        time.sleep(0.1)  # a loop would need some time
    for node in nodes.values():
        for name in nodes:
            node.receives("/chat", f"{name} 19")
        counted = Counter(text for _, text in node.received)
        assert [text for _, text in sent if not counted[text]] == []
        assert [text for text, times in counted.items() if times > 1] == []


def test_a_late_subscriber_gets_a_latched_message(lab: LabSwarm, start: Starts) -> None:
    """Also from a relay that was killed and is back."""
    lab.shell(WEST, f"sudo systemctl stop {UNIT}")
    start(EAST, "east", LATCHED).publish("/map_name", "attic")
    lab.shell(WEST, f"sudo systemctl start {UNIT}")
    early = start(WEST, "early", subscribes=LATCHED)
    early.receives("/map_name", "attic")
    start(WEST, "late", subscribes=LATCHED).receives("/map_name", "attic")
    killed = lab.units(WEST)["multimaster"].pid
    lab.shell(WEST, f"sudo systemctl kill -s KILL {UNIT}")
    early.receives("/map_name", "attic", times=2)
    assert lab.units(WEST)["multimaster"].pid != killed
    start(WEST, "later", subscribes=LATCHED).receives("/map_name", "attic")


def test_a_sensor_arrives_at_its_rate_with_best_effort(start: Starts, note: Note) -> None:
    east, west = start(EAST, "east", SENSOR), start(WEST, "west", subscribes=SENSOR)
    east.reaches(west, "/bumps")
    for number in range(SAMPLES):
        east.publish("/bumps", str(number))
        time.sleep(1 / RATE)
    arrived = [int(text) for _, text in west.received if text.isdigit()]
    note("relay: samples of a sensor at 20 Hz that arrive", f"{len(arrived)} of {SAMPLES}", "")
    assert len(arrived) >= SAMPLES * (1 - LOST)
    assert arrived == sorted(set(arrived))
    assert west.publishers["/bumps"] == [("east", False)]


def test_an_undeclared_topic_stays_on_its_island(start: Starts) -> None:
    """Nobody elsewhere receives it or sees its name, while a declared one of the same node crosses."""
    both = {**PLAIN, "/diary": "plain"}
    east, west = start(EAST, "east", both), start(WEST, "west", subscribes=PLAIN)
    east.reaches(west, "/chat")
    assert "/diary" not in west.publishers
    curious = start(WEST, "curious", subscribes=both)
    for number in range(10):
        east.publish("/diary", str(number))
    east.reaches(curious, "/chat")
    assert [topic for topic, _ in curious.received if topic == "/diary"] == []
    assert curious.publishers["/diary"] == []


def test_a_node_that_ends_leaves_the_other_islands_graph(start: Starts) -> None:
    """On a busy host Fast DDS 2's server keeps the publisher, without a name, until the relay ends."""
    east, west = start(EAST, "passer_by", PLAIN), start(WEST, "west", subscribes=PLAIN)
    until(lambda: ("passer_by", True) in west.publishers.get("/chat", []), "it is not in the graph")
    east.end()
    until(lambda: "passer_by" not in west.nodes, lambda: f"it is still in the graph: {west.nodes}")
    until(
        lambda: {name for name, _ in west.publishers["/chat"]} <= {"_NODE_NAME_UNKNOWN_"},
        lambda: f"it still publishes: {west.publishers}",
    )
