"""The toy middleware and the toy provider on hosts: deployed by the agent, observed by their own probe."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from swarmctl.deploy.outcome import Outcome
from swarmctl.health.collect import probe_hosts
from swarmctl.health.diagnosis import diagnose
from swarmctl.health.expected_graph import ExpectedGraph, Release, expected_graph
from swarmctl.health.root_cause import Diagnosis, Finding
from swarmctl.health.swarm_health import Status, status
from swarmctl.health.verdict import State
from swarmctl.remote import parallel_hosts
from swarmctl.remote.transport import Session, Target
from swarmctl.render.build_bundle import bundles
from swarmctl.views import status as view
from tests.deploy.deploying import deploy
from tests.onboard.agent.fakehost import FakeHost
from tests.onboard.agent.local_session import LocalSession
from tests.seams.toy_spec import HUB, SILENT, swarm_of, written

PATH = "nav_msgs/msg/Path"
WANDER = (
    "wander: {host: k3-pi, package: moves, executable: wander, "
    "publishes: [{topic: plan, type: nav_msgs/Path}]}"
)
ODOM, TWIST = "nav_msgs/msg/Odometry", "geometry_msgs/msg/Twist"


@dataclass
class Hosts:
    """The toy swarm on hosts in folders."""

    graph: ExpectedGraph
    by_name: Mapping[str, FakeHost]

    @contextmanager
    def connect(self, target: Target) -> Iterator[Session]:
        yield LocalSession(self.by_name[target.host].environment())

    def status(self) -> Status:
        """What ``swarmctl status`` shows."""
        outcomes = probe_hosts(self.graph, _targets(self.by_name), self, window=0.5, parallel=4)
        return status(self.graph, outcomes, diagnose(self.graph, outcomes))

    def diagnosis(self) -> Diagnosis:
        """What ``swarmctl status`` finds."""
        return self.status().diagnosis

    def run(self, host: str, name: str, *, seen_at: str = "", **changes: Any) -> None:
        """Let pebbled of ``host``, or of ``seen_at``, list a node of ``host``."""
        folder = self.by_name[seen_at or host].prefix / "run/pebble"
        folder.mkdir(exist_ok=True)
        node = {"name": name, "host": host, "publishes": {}, "subscribes": {}, "rates": {}, "status": ""}
        (folder / name.strip("/")).write_text(json.dumps({**node, **changes}), "utf-8")

    def start_nodes(self) -> None:
        """What the units of the deployed releases start."""
        for name, host in self.by_name.items():
            for robot in host.read("opt/swarm/new/current/pebble/robots.txt").decode().split():
                self.run(
                    name, f"/pebbled_{name}",
                    publishes={f"/{robot}/odom": ODOM}, rates={f"/{robot}/odom": 10.0},
                    subscribes={f"/{robot}/cmd_vel": TWIST},
                )  # fmt: skip
        self.run(SILENT, "/wander", publishes={"/plan": PATH})
        self.run(HUB, f"/mesh_{HUB}", status="1 topic")
        for line in self.by_name[HUB].read("opt/swarm/new/current/mesh/topics.txt").decode().splitlines():
            origin, topic = line.split()
            self.run(origin, f"/pebbled_{origin}", seen_at=HUB, publishes={topic: ODOM})


def _targets(hosts: Mapping[str, FakeHost]) -> dict[str, Target]:
    return {name: Target(name, "192.0.2.1", "robot") for name in hosts}


@pytest.fixture
def hosts(tmp_path: Path, registered: None) -> Hosts:
    """Every host has its release from a real agent, and runs what it starts."""
    swarm = swarm_of(written(tmp_path, name="new", programs=WANDER))
    wanted = bundles(swarm)
    made = {name: FakeHost(tmp_path / name) for name in wanted}
    for host in made.values():
        (host.prefix / "usr/bin").mkdir(parents=True)
        for program, text in (("usr/bin/pebbled", ""), ("bin/sudo", 'shift\nexec "$@"\n')):
            (host.prefix / program).write_text(f"#!/bin/sh\n{text}")
            (host.prefix / program).chmod(0o755)
    releases = {
        name: Release(one.digest, tuple(unit.name for unit in one.units)) for name, one in wanted.items()
    }
    found = Hosts(expected_graph(swarm, releases), made)
    for event in deploy(wanted, _targets(made), found):
        if isinstance(event, parallel_hosts.Finished):
            outcome = event.outcome
            assert isinstance(outcome, Outcome), outcome
            assert outcome.plan.problem is None, outcome.plan.problem
    found.start_nodes()
    return found


def of(diagnosis: Diagnosis, check: str) -> dict[str, Finding]:
    return {one.subject: one for one in diagnosis.findings if one.check == check}


def wrong(diagnosis: Diagnosis) -> dict[str, str]:
    """What is not well, but for this machine itself: no robot is plugged into it, and it may be busy."""
    return {
        one.key: one.message
        for one in diagnosis.findings
        if one.state not in (State.OK, State.SKIPPED) and one.check not in ("device", "load")
    }


def test_a_healthy_swarm_has_no_other_finding(hosts: Hosts) -> None:
    seen = hosts.status()
    diagnosis = seen.diagnosis
    assert wrong(diagnosis) == {}
    assert "master" not in view.status(seen).plain
    assert {name: one.message for name, one in of(diagnosis, "driver").items()} == {
        "koala": "/pebbled_koala-laptop runs",
        "k3": "/pebbled_k3-pi runs",
        "epuck": "/pebbled_epuck-pi runs",
    }
    [topic] = [one for name, one in of(diagnosis, "topic").items() if name.endswith("koala")]
    assert topic.message == "measured 10.0 Hz of 10"
    [bridge] = of(diagnosis, "bridge").values()
    assert (bridge.subject, bridge.message) == (
        "/k3/odom from k3-pi to koala-laptop",
        "/pebbled_k3-pi received",
    )
    [mesh] = of(diagnosis, "multimaster").values()
    assert (mesh.subject, mesh.message) == (f"/mesh_{HUB} on {HUB}", "1 topic")


def test_a_node_that_ended_is_found_without_a_master(hosts: Hosts) -> None:
    (hosts.by_name[SILENT].prefix / "run/pebble/pebbled_k3-pi").unlink()
    diagnosis = hosts.diagnosis()
    assert wrong(diagnosis) == {
        "driver k3": "/pebbled_k3-pi is not in the graph although its unit runs",
        "bridge /k3/odom from k3-pi to koala-laptop": (
            "koala-laptop still lists /pebbled_k3-pi, which left k3-pi"
        ),
    }
    assert [one.cause for one in of(diagnosis, "bridge").values()] == ["driver k3"]


def test_a_program_is_checked_by_the_names_of_its_middleware(hosts: Hosts) -> None:
    assert of(hosts.diagnosis(), "program")["wander"].message == "runs"
    hosts.run(SILENT, "/wander", publishes={"/plan": "nav_msgs/Path"})
    assert wrong(hosts.diagnosis()) == {
        "program wander": f"/plan of /wander has type nav_msgs/Path instead of {PATH}"
    }


def test_types_and_rates_are_compared_in_their_own_names(hosts: Hosts) -> None:
    hosts.run(
        SILENT, "/pebbled_k3-pi",
        publishes={"/k3/odom": ODOM}, rates={"/k3/odom": 2.0},
        subscribes={"/k3/cmd_vel": "geometry_msgs/Twist"},
    )  # fmt: skip
    hosts.run(SILENT, "/pebbled_k3-pi", seen_at=HUB, publishes={"/k3/odom": "nav_msgs/Odometry"})
    found = hosts.diagnosis()
    assert of(found, "driver")["k3"].message == (
        f"/pebbled_k3-pi subscribes to /k3/cmd_vel as geometry_msgs/Twist instead of {TWIST}"
    )
    # Behind it stands that the processors were busy, if they were.
    assert of(found, "topic")["/k3/odom of k3"].message.startswith("measured 2.0 Hz of 10")
    [bridge] = of(found, "bridge").values()
    assert bridge.message == f"has type nav_msgs/Odometry instead of {ODOM} at {HUB}"
    assert len(wrong(found)) == 3


def test_an_unauthorised_publisher_of_commands_is_found(hosts: Hosts) -> None:
    hosts.run("192.168.77.99", "/intruder", seen_at=SILENT, publishes={"/k3/cmd_vel": TWIST})
    found = wrong(hosts.diagnosis())
    assert list(found) == ["authority k3"]
    assert "/intruder on 192.168.77.99" in found["authority k3"]


def test_a_probe_that_fails_costs_the_graph_only(hosts: Hosts) -> None:
    for file in (hosts.by_name["epuck-pi"].prefix / "run/pebble").iterdir():
        file.write_text("no JSON", "utf-8")
    diagnosis = hosts.diagnosis()
    found = wrong(diagnosis)
    assert set(found) == {"probe epuck-pi ros", "driver epuck"}
    assert found["probe epuck-pi ros"].startswith("JSONDecodeError")
    assert of(diagnosis, "driver")["epuck"].cause == "probe epuck-pi ros"
    assert of(diagnosis, "release")["epuck-pi"].state is State.OK
