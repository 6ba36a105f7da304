"""The requests to record: each topic of a spec is in that of one host, on which a node publishes it."""

from __future__ import annotations

import shlex
from collections import Counter
from pathlib import Path

import pytest
from swarm_onboard.agent.verbs.record import Request, topics_here

from swarmctl.render.bag_recorder import MCAP, ROSBAG, BagRecorder
from swarmctl.render.recording_requests import requests
from swarmctl.swarm.resolved import Swarm
from tests import ROOT
from tests.loading import load_swarm

EXAMPLES = sorted([*ROOT.glob("examples/paper-*/swarm.yaml"), *ROOT.glob("examples/ros2-*/swarm.yaml")])


def swarm_of(file: Path) -> Swarm:
    swarm, diagnostics = load_swarm(file)
    assert swarm is not None, diagnostics
    return swarm


def requested(swarm: Swarm, *patterns: str) -> dict[str, Request]:
    accounts = {name: host.user for name, host in swarm.hosts.items()}
    return requests(swarm, accounts, patterns, seconds=0.0, megabytes=256)


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.parent.name)
def test_one_host_of_an_island_records_a_topic(file: Path) -> None:
    swarm = swarm_of(file)
    found = requested(swarm, "*")
    assert list(found) == [host for island in swarm.islands for host in island.hosts]
    for island in swarm.islands:
        topics = {host: topics_here(found[host], {}) for host in island.hosts}
        times = Counter(topic for host in island.hosts for topic in topics[host])
        assert set(times.values()) <= {1}
        for name in island.hosts:
            for robot in swarm.robots_on(name):
                assert f"{robot.namespace}/odom" in topics[name]
                assert not robot.command or robot.command.topic in times
        assert "/diagnostics" not in times or "/diagnostics" in topics[island.hub]


def test_a_request_has_only_topics_that_match() -> None:
    swarm = swarm_of(ROOT / "examples/paper-leader/swarm.yaml")
    found = requested(swarm, "/k3/odom", "*/battery")
    topics = {host: topics_here(one, {}) for host, one in found.items()}
    assert topics == {
        "koala-laptop": ["/koala/battery"],
        "k3-pi": ["/k3/battery", "/k3/odom"],
        "epuck-pi": ["/epuck/battery"],
    }


def test_a_host_knows_where_the_nodes_of_its_island_run() -> None:
    swarm = swarm_of(ROOT / "examples/paper-leader/swarm.yaml")
    graph = requested(swarm, "*")["k3-pi"]
    assert (graph.host, graph.hub) == ("k3-pi", "koala-laptop")
    for host in swarm.hosts.values():
        assert graph.homes[host.address] == graph.homes[host.name] == host.name


@pytest.mark.parametrize("recorder", [ROSBAG, MCAP])
def test_topics_are_words_of_the_recorder_and_not_of_the_setup_file(recorder: BagRecorder) -> None:
    shell, option, script, name = recorder.command("lab", "pi-1", 64)
    assert (shell, option, name) == ("bash", "-c", "record")
    words = shlex.split(script)
    assert words[:3] == ["topics=($@);", "set", "--;"]
    assert words[-1] == "${topics[@]}"
    assert words[-4:-1] == ["--size=64", "-o", "pi-1"]
