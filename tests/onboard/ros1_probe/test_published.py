"""Which of an island's topics a host records: those that its nodes alone publish; a hub all others, too."""

from __future__ import annotations

import pytest
from swarm_onboard.agent.errors import FailedError
from swarm_onboard.agent.verbs.record import Request, topics_here
from swarm_onboard.ros1_probe.published import published

from tests.onboard.ros1_probe.ros_fakes import FakeRos, served
from tests.ports import free_port

HOMES = {"192.168.77.10": "laptop", "laptop": "laptop", "192.168.77.11": "pi", "pi": "pi"}


def request(master: str, host: str, patterns: tuple[str, ...] = ("*",), **declared: str) -> Request:
    return Request(
        "new", "robot", [], list(patterns), 0.0,
        module="", master=master, host=host, hub="laptop", homes=HOMES, nodes={}, awaited=[],
        declared={f"/{one}": declared[one] for one in declared},
    )  # fmt: skip


def test_every_topic_is_that_of_one_host() -> None:
    fake = FakeRos(
        {
            "/tool": "http://Laptop:4002/",
            "/k3/driver": "http://192.168.77.11:4003/",
            "/camera": "http://pi:4004/",
            "/stranger": "http://192.168.77.99:4005/",
        },
        {
            "/k3/odom": ["/k3/driver"],
            "/image": ["/camera", "/k3/driver"],
            "/tf": ["/k3/driver", "/tool"],
            "/map": ["/tool"],
            "/foreign": ["/stranger"],
            "/both": ["/camera", "/stranger"],
            "/stale": ["/gone"],
        },
        {},
        {},
    )
    with served(fake.functions()) as uri:
        found = published(request(uri, "pi"))
    assert topics_here(request(uri, "pi"), found) == ["/image", "/k3/odom"]
    others = ["/both", "/foreign", "/map", "/stale", "/tf"]
    assert topics_here(request(uri, "laptop"), found) == others


def test_a_master_that_does_not_answer_is_an_error() -> None:
    with pytest.raises(FailedError):
        published(request(f"http://127.0.0.1:{free_port()}", "pi"))


def test_a_topic_of_the_spec_is_that_of_its_host_alone() -> None:
    found = {"/image": {"pi"}, "/scan": {"pi", "laptop"}, "/map": {"laptop"}}
    declared = {"image": "laptop", "scan": "pi", "silent": "pi"}
    assert topics_here(request("", "pi", **declared), found) == ["/scan", "/silent"]
    assert topics_here(request("", "laptop", **declared), found) == ["/image", "/map"]
    assert topics_here(request("", "pi", ("/s*n", "/map"), **declared), found) == ["/scan"]
