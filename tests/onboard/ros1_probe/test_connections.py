"""It finds subscribers of its host that have no connection to a publisher that the master lists."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from swarm_onboard.agent.observations import UnconnectedSeen
from swarm_onboard.agent.verbs.probe import Request
from swarm_onboard.ros1_probe import client, connections
from swarm_onboard.ros1_probe.connections import md5_of

from tests.onboard.ros1_probe.ros_fakes import FakeRos, header, peer, received_header, served, slave

COMMAND, TWIST = "/k3/cmd_vel", "geometry_msgs/Twist"
HERE, OTHER = "9f195f881246fdfa2798d1d3eebca84a", "0" * 32
Bus = list[list[Any]]


@pytest.fixture(autouse=True)
def _soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "_TIME_TO_CONNECT", 0.0)
    monkeypatch.setattr(connections, "md5_of", lambda kind, pid: f"{kind} of {pid}")


def connection(far: str, topic: str = COMMAND, *, connected: Any = True) -> list[Any]:
    return [1, far, "i", "TCPROS", topic, connected, "TCPROS connection on port 4711"]


@contextmanager
def two_nodes(of_driver: Bus, of_pilot: Bus) -> Iterator[FakeRos]:
    """A driver that subscribes to commands, a pilot that publishes them, and the connections of each.

    ``PILOT`` as a far end stands for the URI of the pilot.
    """
    with peer(lambda one: received_header(one) and one.sendall(header(type=TWIST, md5sum=OTHER))) as port:
        pilot = slave({COMMAND: port}, {COMMAND: TWIST}) | {"getBusInfo": lambda caller: [1, "", of_pilot]}
        with served(pilot) as uri:
            bus = [[uri if field == "PILOT" else field for field in one] for one in of_driver]
            with served(
                slave({}, {}, {COMMAND: TWIST}) | {"getBusInfo": lambda caller: [1, "", bus]}
            ) as driver:
                nodes = {"/k3/driver": driver, "/pilot": uri}
                yield FakeRos(nodes, {COMMAND: ["/pilot"]}, {COMMAND: ["/k3/driver"]})


def looked(fake: FakeRos, advertised: str = "127.0.0.1") -> list[UnconnectedSeen]:
    with served(fake.functions()) as master:
        request = Request("new", "", master=master, advertised=advertised, inputs=[COMMAND])
        return asyncio.run(connections.without_connection(request, (fake.publishers, fake.subscribers)))


TO_PILOT, TO_DRIVER = connection("PILOT"), connection("/k3/driver", connected=1)
CASES: dict[str, tuple[Bus, Bus, bool]] = {
    "connected": ([TO_PILOT], [TO_DRIVER], False),
    "neither knows of it": ([], [], True),
    "the publisher's host has restarted": ([TO_PILOT], [], True),
    "the subscriber has closed it": ([], [TO_DRIVER], True),
    "on another topic": ([connection("PILOT", "/rosout")], [TO_DRIVER], True),
    "lost": ([connection("PILOT", connected=False)], [TO_DRIVER], True),
    "without a last field, as in ROS before Groovy": ([TO_PILOT[:6]], [TO_DRIVER[:6]], False),
}


@pytest.mark.parametrize(("of_driver", "of_pilot", "missing"), CASES.values(), ids=CASES.keys())
def test_both_nodes_must_know_of_a_connection(of_driver: Bus, of_pilot: Bus, missing: bool) -> None:
    with two_nodes(of_driver, of_pilot) as fake:
        assert bool(looked(fake)) is missing


def test_a_pair_has_the_type_and_both_md5_sums() -> None:
    with two_nodes([], []) as fake:
        assert looked(fake) == [
            UnconnectedSeen(
                "/k3/driver",
                "/pilot",
                fake.nodes["/pilot"].rstrip("/"),
                COMMAND,
                TWIST,
                f"{TWIST} of 42",
                publisher_type=TWIST,
                publisher_md5=OTHER,
            )
        ]


def test_a_subscriber_of_another_host_is_looked_at_there() -> None:
    with two_nodes([], []) as fake:
        assert looked(fake, advertised="10.0.0.1") == []


@pytest.mark.parametrize("bus", [7, [7], [["a"]]])
def test_a_node_that_talks_nonsense_has_no_pairs(bus: Any) -> None:
    with two_nodes([], bus) as fake:
        assert looked(fake) == []


def test_a_publisher_that_is_gone_has_no_pairs() -> None:
    with two_nodes([], []) as fake:
        fake.nodes["/pilot"] = "http://127.0.0.1:9/"
        assert looked(fake) == []


def test_a_subscriber_has_a_moment_to_connect(monkeypatch: pytest.MonkeyPatch) -> None:
    call, of_driver, of_pilot = client.call, [TO_PILOT], [TO_DRIVER]
    called: list[str] = []

    async def late(uri: str, method: str, *arguments: Any, **named: Any) -> Any:
        called.append(method)
        return (
            []
            if called.count("getBusInfo") in (1, 2) and method == "getBusInfo"
            else await call(uri, method, *arguments, **named)
        )

    monkeypatch.setattr(client, "call", late)
    with two_nodes(of_driver, of_pilot) as fake:
        assert looked(fake) == []
    assert called.count("getBusInfo") == 4


def module(folder: Path, package: str, name: str, content: str) -> Path:
    path = folder / package / "msg" / f"_{name}.py"
    path.parent.mkdir(parents=True)
    path.write_text(content)
    return path


def process(proc: Path, **variables: str) -> str:
    (proc / "42").mkdir(parents=True)
    (proc / "42" / "environ").write_text("".join(f"{name}={value}\0" for name, value in variables.items()))
    return str(proc)


def test_the_md5_sum_is_that_of_the_first_module_on_the_path(tmp_path: Path) -> None:
    module(tmp_path / "ws", "lab_msgs", "Ping", f'class Ping:\n  _md5sum = "{HERE}"\n')
    module(tmp_path / "ros", "lab_msgs", "Ping", f'class Ping:\n  _md5sum = "{OTHER}"\n')
    proc = process(tmp_path / "proc", PATH="/bin", PYTHONPATH=f"{tmp_path}/ws:{tmp_path}/ros")
    assert md5_of("lab_msgs/Ping", 42, proc) == HERE


@pytest.mark.parametrize("kind", ["lab_msgs/Pong", "lab_msgs", "", "../Ping"])
def test_an_unknown_type_has_no_md5_sum(tmp_path: Path, kind: str) -> None:
    module(tmp_path / "ws", "lab_msgs", "Ping", f'_md5sum = "{HERE}"')
    module(tmp_path, ".", "Ping", f'_md5sum = "{HERE}"')
    assert md5_of(kind, 42, process(tmp_path / "proc", PYTHONPATH=f"{tmp_path}/ws")) == ""


def test_a_module_without_a_sum_has_none(tmp_path: Path) -> None:
    path = module(tmp_path / "ws", "lab_msgs", "Ping", "import this")
    assert md5_of("lab_msgs/Ping", 42, process(tmp_path / "proc", PYTHONPATH=f"{tmp_path}/ws")) == ""
    assert md5_of("lab_msgs/Ping", 7, str(tmp_path / "proc")) == ""  # a process that has ended
    path.unlink()
    path.mkdir()
    assert md5_of("lab_msgs/Ping", 42, str(tmp_path / "proc")) == ""
