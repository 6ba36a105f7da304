"""Which of an island's topics a host records: those that its nodes alone publish; a hub all others, too."""

from __future__ import annotations

import pytest
from swarm_onboard.agent.errors import FailedError
from swarm_onboard.agent.recording_messages import Graph
from swarm_onboard.ros1_probe.published import published

from tests.onboard.ros1_probe.ros_fakes import FakeRos, served
from tests.ports import free_port

HOMES = {"192.168.77.10": "laptop", "laptop": "laptop", "192.168.77.11": "pi", "pi": "pi"}


def graph(master: str, host: str) -> Graph:
    return {"module": "", "master": master, "host": host, "hub": "laptop", "homes": HOMES}


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
        assert published(graph(uri, "pi")) == ["/image", "/k3/odom"]
        assert published(graph(uri, "laptop")) == ["/both", "/foreign", "/map", "/stale", "/tf"]


def test_a_master_that_does_not_answer_is_an_error() -> None:
    with pytest.raises(FailedError):
        published(graph(f"http://127.0.0.1:{free_port()}", "pi"))
