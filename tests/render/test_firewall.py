"""The firewall of filtered hosts lets every flow of the graph pass, and nothing else reach ROS."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import product
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from swarm_onboard.ros2_probe import observe

from swarmctl.render.firewall import FILTERED
from swarmctl.spec.model import Mode, Spec
from swarmctl.spec.ros_model import Multimaster
from swarmctl.swarm.discovery import Discovery
from swarmctl.swarm.flow import Service
from swarmctl.swarm.flows import ros_flows
from swarmctl.swarm.resolved import Bridge, Host, Island, Swarm
from tests.render.nft_verdict import Packet, verdict

NEEDED = pytest.mark.skipif(
    os.geteuid() != 0 or shutil.which("nft", path="/usr/sbin:/usr/bin") is None, reason="needs root and nft"
)
pytestmark = NEEDED
GRAPHS = int(os.environ.get("SWARM_GRAPHS", "50"))
USER, OTHER, DYNAMIC = 65534, 5000, 61200  # `nobody` stands for the account of a host
STRANGERS = ("10.9.9.9", "fd00::9:9")
EPHEMERAL = (32768, 40000, 60999)
FIRST_OF_DOMAIN = 7400
NO_ROS = (80, 9090, 3128, 61000)


@pytest.fixture(scope="module")
def namespace() -> Iterator[str]:
    name = f"swarm-test-{os.getpid()}"
    subprocess.run(["ip", "netns", "add", name], check=True)
    yield name
    subprocess.run(["ip", "netns", "del", name], check=True)


def ip(name: str, *argv: str, given: str = "") -> str:
    run = ["ip", "netns", "exec", name, *argv]
    done = subprocess.run(run, input=given, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def loaded(namespace: str, tables: Mapping[str, str]) -> Any:
    """What nft lists of the tables, by the names under which they are loaded."""
    texts = [text.replace("swarm-any", name) for name, text in tables.items()]
    given = "\n".join(["flush ruleset", "define ephemeral = 32768-60999", *texts])
    ip(namespace, "nft", "-f", "-", given=given)
    return json.loads(ip(namespace, "nft", "-j", "list", "ruleset"))


def table_of(swarm: Swarm, host: Host) -> str:
    return "".join(
        file.content.decode()
        for part in FILTERED.parts(swarm, host)
        for file in part.files
        if file.path == "firewall.nft"
    )


@st.composite
def swarms(draw: st.DrawFn) -> Swarm:
    """Islands of some hosts with topics that cross: of ROS 1 with either multimaster, of ROS 2, of both."""
    distros = draw(st.sampled_from((("noetic",), ("noetic",), ("kilted",), ("noetic", "kilted"))))
    provider = draw(st.sampled_from(("static", "fkie"))) if "noetic" in distros else None
    sizes = draw(st.lists(st.integers(1, 3), min_size=1, max_size=4))
    hosts, islands = {}, []
    for number, size in enumerate(sizes):
        distro = draw(st.sampled_from(distros))
        names = [f"h{number}-{one}" for one in range(size)]
        for name in names:
            place = len(hosts) + 1
            address = draw(st.sampled_from((f"10.0.0.{place}", f"fd00::{place}")))
            port = draw(st.sampled_from((22, 22, 2222, 40000, 11311)))
            hosts[name] = Host(
                name, address, "nobody", port, ros_address=address, advertised=address, optional=False
            )
        method = draw(st.sampled_from(("server", "multicast"))) if distro == "kilted" else "server"
        servers = (names[0],) if distro == "kilted" and method == "server" else ()
        found = Discovery(method=method, servers=servers, domain=number)
        level = draw(st.sampled_from(("filtered", "off"))) if number else "filtered"
        port = draw(st.sampled_from((11311, 11321 + number)))
        islands.append(Island(f"i{number}", names[0], tuple(names), distro, port, found, level))
    pairs = st.tuples(st.sampled_from(islands), st.sampled_from(islands)).filter(lambda one: one[0] != one[1])
    joined = draw(st.lists(pairs, max_size=4)) if len(islands) > 1 else []
    bridges = tuple(Bridge(f"/t{n}", "", a.name, (b.name,), "") for n, (a, b) in enumerate(joined))
    settings = Multimaster(provider=provider)
    spec = Spec.model_validate(
        {
            "version": 1, "name": "any", "mode": "standalone", "ros": {"distro": distros[0]},
            "multimaster": settings, "hosts": {"a": {"address": "10.0.0.1"}},
            "robots": {"k3": {"type": "khepera3", "host": "a"}},
        }
    )  # fmt: skip
    return Swarm(
        "any", Mode.STANDALONE, distros[0], None, hosts, {}, (), tuple(islands), bridges,
        flows=tuple(ros_flows(spec, islands, bridges)), multimaster=settings,
    )  # fmt: skip


def services(swarm: Swarm, host: str) -> dict[tuple[str, int], Service]:
    """The ports of ROS on a host, from the manuals: some of those of nodes, all of the others."""
    island = swarm.island_of(host)
    if island.distro == "kilted":
        first = FIRST_OF_DOMAIN + 250 * island.discovery.domain
        ports = {first, first + 10, first + 249} | ({11811} if island.discovery.servers else set())
        found = dict.fromkeys((("udp", one) for one in ports), Service.NODES)
        if exchanges(swarm, island) and host == island.hub:
            found |= dict.fromkeys((("tcp", one) for one in EPHEMERAL), Service.MULTIMASTER)
        return found
    found = dict.fromkeys((("tcp", one) for one in EPHEMERAL), Service.NODES)
    if host == island.hub:
        found["tcp", island.master_port] = Service.MASTER
        several = sum(one.distro == "noetic" for one in swarm.islands) > 1
        if swarm.multimaster.provider == "fkie" and several:
            found["tcp", island.master_port + 300] = found["udp", 11511] = Service.MULTIMASTER
    return found


def exchanges(swarm: Swarm, island: Island) -> bool:
    """True if topics cross between an island of ROS 2 and one of ROS 1."""
    of_ros_1 = {one.name for one in swarm.islands if one.distro == "noetic"}
    ends = ({one.origin, *one.to} for one in swarm.bridges)
    return any(island.name in one and of_ros_1 & one for one in ends)


def declared(swarm: Swarm, source: str, host: str, service: Service) -> bool:
    return any(one.service is service and source in one.sources and host in one.hosts for one in swarm.flows)


def filtered_hosts(swarm: Swarm) -> list[Host]:
    return [one for one in swarm.hosts.values() if swarm.island_of(one.name).filtered]


@given(swarm=swarms())
@settings(max_examples=GRAPHS)
def test_every_declared_flow_passes_and_no_other(namespace: str, swarm: Swarm) -> None:
    rules = loaded(namespace, {one.name: table_of(swarm, one) for one in filtered_hosts(swarm)})
    sources = {one.address: one.name for one in swarm.hosts.values()} | dict.fromkeys(STRANGERS, "")
    for host, source in product(filtered_hosts(swarm), sources):
        if source != host.address and (":" in source) == (":" in host.address):
            check_arrivals(rules, swarm, host, source, sources[source])


def check_arrivals(rules: Any, swarm: Swarm, host: Host, source: str, name: str) -> None:
    def arrives(port: int, protocol: str = "tcp", **changed: Any) -> bool:
        packet = Packet(source, host.address, port, protocol)
        return verdict(rules, host.name, "input", replace(packet, **changed)) == "accept"

    assert arrives(host.port), "SSH, whoever it is"
    assert all(map(arrives, NO_ROS))
    assert arrives(40000, flags=frozenset({"ack"})), "an answer to what the host has opened"
    for (protocol, port), service in services(swarm, host.name).items():
        if (protocol, port) != ("tcp", host.port):
            passes = declared(swarm, name, host.name, service)
            assert arrives(port, protocol) == passes, (name, host.name, service, port)
            assert protocol == "udp" or not arrives(port, connections=5000)
            assert arrives(port, protocol, interface="lo"), "decided where it leaves"


@given(swarm=swarms())
@settings(max_examples=GRAPHS)
def test_other_accounts_reach_no_ros(namespace: str, swarm: Swarm) -> None:
    rules = loaded(namespace, {one.name: table_of(swarm, one) for one in filtered_hosts(swarm)})
    for host, other in product(filtered_hosts(swarm), swarm.hosts.values()):
        check_accounts(rules, swarm, host, other)


def check_accounts(rules: Any, swarm: Swarm, host: Host, other: Host) -> None:
    same = host.name == other.name

    def leaves(account: int, port: int, protocol: str = "tcp", to: str = other.address) -> bool:
        interface = "lo" if same else "wlan0"
        packet = Packet(host.address, to, port, protocol, account=account, interface=interface)
        return verdict(rules, host.name, "output", packet) == "accept"

    def answers(account: int, port: int, protocol: str) -> bool:
        packet = Packet(host.address, other.address, 50000, protocol, account=account, origin=port)
        packet = replace(packet, flags=frozenset({"ack"}), direction="reply")
        return verdict(rules, host.name, "output", packet) == "accept"

    looks = (observe.ACCOUNT,) if swarm.distro_of(host.name) == "kilted" else ()
    assert all(leaves(OTHER, port) for port in NO_ROS)
    for (protocol, port), service in services(swarm, other.name).items():
        assert all(leaves(one, port, protocol) for one in (0, USER, DYNAMIC, *looks))
        if same or declared(swarm, host.name, other.name, service):
            assert not leaves(OTHER, port, protocol), (host.name, other.name, service, port)
        if same and (protocol, port) != ("tcp", host.port):
            assert all(answers(one, port, protocol) for one in (0, USER, DYNAMIC, *looks))
            assert not answers(OTHER, port, protocol), (host.name, service, port)
        if same:
            of_programs = protocol == "tcp" and port in EPHEMERAL
            own = "::1" if ":" in host.address else "127.0.0.1"
            assert leaves(OTHER, port, protocol, own) == of_programs
