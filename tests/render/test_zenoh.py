"""What is rendered for Zenoh, by Zenoh's own engine: routers, and sessions with the keys of rmw_zenoh."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
import yaml
import zenoh

from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from tests import ROOT
from tests.loading import load_swarm
from tests.render.rendered import text_of

SPEC = """\
version: 1
name: pair
mode: combined
ros: {distro: kilted, rmw: zenoh, domain: 11}
hosts:
  desk: {address: 192.168.77.10, computer: laptop}
  spare: {address: 192.168.77.11, computer: laptop}
  van: {address: 192.168.77.12, computer: laptop}
  k3-pi: {address: 192.168.77.13, computer: raspberry-pi-3b}
robots:
  k3: {type: khepera3, host: k3-pi}
islands:
  lab: {mode: central, hub: desk, hosts: [desk, spare]}
  field: {mode: central, hub: van, hosts: [van, k3-pi]}
links:
  - {kind: wlan, name: net, hosts: [desk, spare, van, k3-pi]}
  - {kind: serial, host: k3-pi, robot: k3, usb: {serial: FTDI1234}}
programs:
  keys: {host: spare, use: teleop-key}
control:
  - {by: keys, of: [k3]}
multimaster:
  topics: [{topic: /k3/odom, to: [lab]}]
time: {root: desk}
"""
LAB, FIELD = 11, 12  # domains
#: A variable and its value, in a file that systemd reads.
SETTING = re.compile(r'^ZENOH_CONFIG_OVERRIDE="(.*)"$', re.MULTILINE)


@pytest.fixture(scope="module")
def hosts(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Bundle]:
    spec = tmp_path_factory.mktemp("zenoh") / "swarm.yaml"
    spec.write_text(SPEC, "utf-8")
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    assert found == ()
    return bundles(swarm)


def opened(override: str) -> Any:
    """A session as rmw_zenoh makes one: without multicast. The hosts are on loopback."""
    config = zenoh.Config()
    config.insert_json5("scouting/multicast/enabled", "false")
    for one in override.replace("192.168.77.", "127.77.33.").split(";"):
        key, _, value = one.partition("=")
        config.insert_json5(key, value)
    return zenoh.open(config)


def router_of(bundle: Bundle, swarm: str = "pair") -> str:
    """The settings of the router of a hub."""
    unit = text_of(bundle, f"units/swarm-{swarm}.discovery.service")
    (words,) = (shlex.split(line) for line in unit.splitlines() if line.startswith("ExecStart="))
    (override,) = (one for one in words if one.startswith("ZENOH_CONFIG_OVERRIDE="))
    return 'mode="router";' + override.partition("=")[2]


def node_of(bundle: Bundle, file: str = "env/ros.env") -> str:
    """The settings of a node on this host."""
    (value,) = SETTING.findall(text_of(bundle, file))
    return str(value).replace('\\"', '"')


def visitor_of(bundle: Bundle) -> str:
    """The settings of the relay on this hub, for its node on the other island."""
    (peer,) = yaml.safe_load(text_of(bundle, "params/relay.yaml"))["peers"]
    return str(peer["environment"]["ZENOH_CONFIG_OVERRIDE"])


@contextmanager
def sessions(*overrides: str) -> Iterator[list[Any]]:
    with ExitStack() as stack:
        yield [stack.enter_context(closing(opened(one))) for one in overrides]


@contextmanager
def closing(session: Any) -> Iterator[Any]:
    """Zenoh gives up closing after 10 s, which no test is about."""
    try:
        yield session
    finally:
        with suppress(zenoh.ZError):
            session.close()


def key(domain: int, topic: str) -> str:
    """The key of a topic. Its last part is the hash of the type's definition (REP 2011)."""
    return f"{domain}{topic}/geometry_msgs::msg::dds_::Twist_/RIHS01_{'9c' * 32}"


def first(publisher: Any, subscriber: Any) -> bytes:
    """The first message that ``subscriber`` gets; finding each other takes a while."""
    while True:
        publisher.put(b"drive")
        if (sample := subscriber.try_recv()) is not None:
            return bytes(sample.payload)


def test_a_relay_receives_at_the_other_islands_router(hosts: Mapping[str, Bundle]) -> None:
    routers = [router_of(hosts[hub]) for hub in ("desk", "van")]
    teleop, driver = node_of(hosts["spare"]), node_of(hosts["k3-pi"])
    home, away = node_of(hosts["van"], "env/relay.env"), visitor_of(hosts["van"])
    with sessions(*routers, teleop, driver, home, away) as (_, _, commander, robot, here, there):
        commands = commander.declare_publisher(key(LAB, "/k3/cmd_vel"))
        everything = robot.declare_subscriber("**")
        assert first(commands, there.declare_subscriber(key(LAB, "/k3/cmd_vel"))) == b"drive"
        relayed = here.declare_publisher(key(FIELD, "/k3/cmd_vel"))
        assert first(relayed, everything) == b"drive"
        commands.put(b"not relayed")
        relayed.put(b"last")
        arrived = [everything.recv()]
        while bytes(arrived[-1].payload) != b"last":
            arrived.append(everything.recv())
        assert {str(one.key_expr) for one in arrived} == {key(FIELD, "/k3/cmd_vel")}


def test_a_relay_does_not_wait_for_the_other_islands_router(hosts: Mapping[str, Bundle]) -> None:
    """Another node's settings would fail, and with them the relay on all islands."""
    there = opened(visitor_of(hosts["desk"]))
    odometry = there.declare_subscriber(key(FIELD, "/k3/odom"))
    with pytest.raises(zenoh.ZError, match="Unable to connect"):
        opened(node_of(hosts["k3-pi"]))
    with sessions(router_of(hosts["van"]), node_of(hosts["k3-pi"])) as (_, robot), closing(there):
        assert first(robot.declare_publisher(key(FIELD, "/k3/odom")), odometry) == b"drive"


def test_a_robot_on_its_own_needs_no_network(tmp_path: Path) -> None:
    """Its nodes use loopback, and its router listens on every address there is."""
    spec = tmp_path / "swarm.yaml"
    text = (ROOT / "examples/ros2-4-standalone/swarm.yaml").read_text("utf-8")
    spec.write_text(text.replace("{distro: jazzy}", "{distro: kilted, rmw: zenoh}"), "utf-8")
    swarm, _ = load_swarm(spec)
    assert swarm is not None
    bundle = bundles(swarm)["k3-pi"]
    assert router_of(bundle, "newswarm").endswith('listen/endpoints=["tcp/0.0.0.0:7447"]')
    assert node_of(bundle).endswith('connect/endpoints=["tcp/127.0.0.1:7447"]')
