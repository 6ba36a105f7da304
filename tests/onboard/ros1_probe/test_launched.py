"""The nodes of a launch file come from roslaunch; those it has lost are named with the way they ended."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import textwrap
import time
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any
from urllib.parse import urlsplit

import pytest
from swarm_onboard.agent import processes, unit_history, unit_journal
from swarm_onboard.agent.errors import FailedError
from swarm_onboard.agent.observations import EndedSeen
from swarm_onboard.agent.processes import Process
from swarm_onboard.agent.unit_journal import Message
from swarm_onboard.agent.verbs.probe import Answer, Request
from swarm_onboard.ros1_probe import launched, nodes, observe

from tests.onboard.agent.fakehost import RUNS
from tests.onboard.ros1_probe.ros_fakes import FakeRos, peer, publishing, served, slave

UNIT = "swarm-test.map.service"
SCAN = "sensor_msgs/LaserScan"
WANTED = {"/lab/scan": 0.5, "/tf": 0.0}  # s to listen to each topic
ROSLAUNCH = textwrap.dedent("""\
    import sys, xmlrpc.server
    server = xmlrpc.server.SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
    lists = [[["lab/scan-2", 1], ["lab/quiet-3", 4], ["rosout-1", 1]], [["lab/gone-4", 1]]]
    server.register_function(lambda: [1, "processes", lists], "list_processes")
    print("listens", flush=True)
    server.serve_forever()
    """)


@pytest.fixture(scope="module")
def roslaunch() -> Iterator[int]:
    """A process that answers as roslaunch does; its number."""
    argv = [sys.executable, "-c", ROSLAUNCH]
    with subprocess.Popen(argv, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        process.stdout.readline()
        yield process.pid
        process.kill()


@pytest.fixture
def graph() -> Iterator[str]:
    """A master that knows two nodes on loopback, one of which publishes /lab/scan at 20 Hz; its URI."""
    with ExitStack() as stack:
        port = stack.enter_context(peer(publishing(SCAN, 20.0)))
        takes = {"/lab/move/goal": "move_base_msgs/MoveBaseActionGoal"}
        kinds = {"/lab/scan": SCAN, "/tf": "x/Y"}
        scan = stack.enter_context(served(slave({"/lab/scan": port}, kinds, takes)))
        ros = FakeRos(
            {"/lab/scan": scan, "/away": "http://10.9.9.9:1/"},
            {"/lab/scan": ["/lab/scan", "/away"]},
            {"/tf": ["/away"], "/lab/move/goal": ["/lab/scan"]},
            services={"/lab/save": ["/lab/scan"], "/lab/load": ["/away"]},
        )
        yield stack.enter_context(served(ros.functions()))


def probed(
    master: str, pid: int, monkeypatch: pytest.MonkeyPatch, lines: Any = (), wanted: Any = WANTED
) -> Answer:
    """What the probe finds of one unit; ``pid``: its roslaunch, or 0. ``lines``: of its log, or an error."""

    def messages(unit: str, since: float, number: int = 0) -> Any:
        if isinstance(lines, Exception):
            raise lines
        return list(lines)

    found = [Process(1, "S", ["/usr/bin/python3", "/x/ros-client", "roslaunch"])]
    found += [Process(pid, "S", ["/usr/bin/python3", "/usr/bin/roslaunch"])] if pid else []
    monkeypatch.setattr(unit_history, "running", lambda units: dict.fromkeys(units, found))
    monkeypatch.setattr(unit_journal, "messages", messages)
    answer = Answer(units={UNIT: RUNS}, since={UNIT: 0.0})
    request = Request(
        "test", observe.__name__, master=master, provides=["/lab/save", "/lab/load", "/lab/move"],
        advertised="127.0.0.1", launched={UNIT: wanted},
    )  # fmt: skip
    return observe.observe_logs(observe.observe(request, answer))


def test_roslaunch_names_its_nodes(graph: str, roslaunch: int, monkeypatch: pytest.MonkeyPatch) -> None:
    answer = probed(graph, roslaunch, monkeypatch)
    found = answer.launched[UNIT]
    assert found.error == ""
    assert found.starts == {"/lab/scan": 1, "/lab/quiet": 4, "/rosout": 1}
    assert found.ended == {"/lab/gone": EndedSeen("", None)}
    assert found.nodes["/lab/quiet"].registered is False
    scan = found.nodes["/lab/scan"]
    assert set(scan.topics) == {"/lab/scan"}
    assert 14 < scan.topics["/lab/scan"].rate < 26
    assert 0 <= scan.topics["/lab/scan"].age < 0.4
    assert answer.troubles == {}


def test_other_programs_are_found_by_their_topics(graph: str, monkeypatch: pytest.MonkeyPatch) -> None:
    found = probed(graph, 0, monkeypatch).launched[UNIT]
    assert list(found.nodes) == ["/lab/scan"]
    assert found.starts == {}


@pytest.mark.parametrize("name", ["/lab/save", "/lab/move"])
def test_they_are_found_by_a_service_or_an_action_too(
    name: str, graph: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The master does not have the type of a service."""
    [(node, found)] = probed(graph, 0, monkeypatch, wanted={name: 0.0}).launched[UNIT].nodes.items()
    assert node == "/lab/scan"
    assert found.provides == {"/lab/save": "", "/lab/move": "move_base_msgs/action/MoveBase"}


def test_a_roslaunch_that_is_gone_costs_its_unit_only(graph: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with subprocess.Popen(["true"]) as gone:
        gone.wait()
    answer = probed(graph, gone.pid, monkeypatch)
    assert "No such file" in answer.launched[UNIT].error
    assert answer.master.reachable


@pytest.mark.parametrize("lists", ["[]", "[[], [], []]", "5", "[5, []]", "[[5], []]"])
def test_an_answer_that_is_not_that_of_roslaunch_costs_its_unit_only(
    lists: str, graph: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with served({"list_processes": lambda: [1, "processes", json.loads(lists)]}) as uri:
        monkeypatch.setattr(processes, "listening_ports", lambda pid=0: [urlsplit(uri).port])
        answer = probed(graph, os.getpid(), monkeypatch)
    assert answer.launched[UNIT].error == "the answer of roslaunch makes no sense"
    assert answer.master.reachable


def test_a_log_that_cannot_be_read_is_a_trouble(
    graph: str, roslaunch: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    answer = probed(graph, roslaunch, monkeypatch, FailedError("no journal"))
    assert answer.troubles == {"launched": "no journal", "conflicts": "no journal"}
    assert answer.launched[UNIT].ended


LOG = [
    Message(100.0, "\x1b[1mprocess[lab/gone-4]: started with pid [77]\x1b[0m"),
    Message(100.0, "process[once-5]: started with pid [78]"),
    Message(103.0, "\x1b[1m[once-5] process has finished cleanly\nlog file: /x/once-5*.log\x1b[0m"),
    Message(
        400.0, "\x1b[31m[lab/gone-4] process has died [pid 77, exit code -9, cmd /x __name:=gone].\x1b[0m"
    ),
    Message(401.0, "[early-6] process has died [pid 7, exit code 1, cmd x]"),
]


def test_the_log_of_roslaunch_has_how_a_node_ended() -> None:
    assert launched.endings_in(LOG) == {
        "/once": EndedSeen("exit code 0", 3.0),
        "/lab/gone": EndedSeen("exit code -9", 300.0),
        "/early": EndedSeen("exit code 1", None),
    }


def test_an_ended_node_gets_its_ending(graph: str, roslaunch: int, monkeypatch: pytest.MonkeyPatch) -> None:
    found = probed(graph, roslaunch, monkeypatch, LOG).launched[UNIT]
    assert found.ended == {"/lab/gone": EndedSeen("exit code -9", 300.0)}


NAMESAKE = "[/lab/scan] Reason: new node registered with same name"


@pytest.mark.parametrize(
    "text",
    [f"shutdown request: {NAMESAKE}", f"[ WARN] [1.2]: Reason given for shutdown: [{NAMESAKE}]"],
    ids=["rospy", "roscpp"],
)
def test_a_node_ended_by_its_namesake_is_counted(text: str) -> None:
    now = time.time()
    lines = [
        Message(now - 50, text),
        Message(now - 20, text),
        Message(now, "shutdown request: [/b] Reason: x"),
    ]
    found = nodes.conflicts_in(lines, now)
    assert found == {"/lab/scan": (2, pytest.approx(20))}


def test_the_log_of_a_unit_that_lost_a_node_is_read(
    graph: str, roslaunch: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = [Message(time.time(), NAMESAKE)]
    assert probed(graph, roslaunch, monkeypatch, lines).conflicts[UNIT]["/lab/scan"].count == 1
    assert probed(graph, 0, monkeypatch, lines).conflicts == {}
