"""A second middleware, a third provider and a fourth level of security, as other packages bring them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from swarmctl.render.bag_recorder import BagRecorder
from swarmctl.render.bundle import File, Part, Unit
from swarmctl.render.firewall import Filtered
from swarmctl.render.middleware import Capability, ExpectedDriver, ExpectedNode
from swarmctl.render.multimaster import Discovery, JoinNodes
from swarmctl.render.topic_tool import TopicTool
from swarmctl.resources import HostModule
from swarmctl.spec.model import Spec
from swarmctl.swarm import names
from swarmctl.swarm.flow import Service
from swarmctl.swarm.ports import Listener, PortRange
from swarmctl.swarm.resolved import Host, Island, Program, Robot, Swarm
from swarmctl.swarm.topics import DriverTopic


def _unit(swarm: Swarm, part: str, needs: tuple[str, ...]) -> Part:
    name = names.unit(swarm.name, part)
    file = File(f"units/{name}", f"[Service]\nExecStart=/usr/bin/{part}\n".encode())
    return Part((file,), (Unit(name, (file.path, *needs)),))


class Pebble:
    """Nodes find each other: no master. One process per host runs all drivers."""

    capabilities: frozenset[Capability] = frozenset({"node-hosts"})
    settings: frozenset[str] = frozenset()
    variables: frozenset[str] = frozenset()
    launcher = ""
    topic_tool = TopicTool(("pebble", "topic"), "pebble_topic")
    bag_recorder = BagRecorder(
        "pebble_bag", HostModule("pebble_probe.published", Path(__file__).parent), ("pebble", "record")
    )
    multimaster = ""
    shared_files: frozenset[str] = frozenset()
    topics: Mapping[str, str] = {
        "/rosout": "rcl_interfaces/Log",
        "/parameter_events": "rcl_interfaces/ParameterEvent",
    }
    master_mb = 0
    probe = HostModule("pebble_probe.observe", Path(__file__).parent)

    def robots(self, swarm: Swarm, host: Host, island: Island) -> Iterator[Part]:
        robots = " ".join(robot.name for robot in swarm.robots_on(host.name))
        file = File("pebble/robots.txt", f"{robots}\n".encode())
        yield Part((file,), requires={"pebbled": ("robots",)})
        yield _unit(swarm, "pebbled", (file.path,))

    def programs(self, swarm: Swarm, host: Host) -> Iterator[Part]:
        return (_unit(swarm, one.name, ()) for one in swarm.programs_on(host.name))

    def launch_files(self, swarm: Swarm, host: Host, island: Island) -> Iterator[File]:
        yield File("pebble.bash", b"exec pebble-shell\n", 0o755)

    def master(self, swarm: Swarm, island: Island) -> None:
        return None

    def discovery_servers(self, swarm: Swarm, island: Island) -> None:
        return None

    def driver(self, swarm: Swarm, robot: Robot) -> ExpectedDriver:
        return ExpectedDriver(
            unit=names.unit(swarm.name, "pebbled"),
            node=f"/pebbled_{robot.host}",
            topics=(DriverTopic(f"{robot.namespace}/odom", self.type_name("nav_msgs/Odometry"), rate=10.0),),
            command=f"{robot.namespace}/cmd_vel",
            command_type=self.type_name("geometry_msgs/Twist"),
            guarded=False,
        )

    def program(self, swarm: Swarm, program: Program) -> ExpectedNode:
        topics = tuple((f"/{one.topic}", self.type_name(one.type)) for one in program.declared.publishes)
        return ExpectedNode(names.unit(swarm.name, program.name), f"/{program.name}", topics, ())

    def type_name(self, kind: str) -> str:
        return kind.replace("/", "/msg/")

    def listeners(self, spec: Spec, island: Island, processes: Mapping[str, int]) -> Iterator[Listener]:
        yield Listener(island.hub, 7400, "pebble's router", ("ros", "distro"))

    def ports(self, island: Island) -> Mapping[Service, Sequence[PortRange]]:
        return {Service.NODES: (PortRange("udp", 7400, 7400),)}

    def most_processes(self, island: Island) -> None:
        return None

    def debian_packages(self, requirement: str) -> tuple[str, ...]:
        return (f"pebble-{requirement}",)

    def package_source(self, platform: str) -> str:
        return ""

    def packages_of_key(self, key: str, *, headers: bool) -> tuple[str, ...]:
        return (f"pebble-{key}",)

    def install_hints(self, missing: Sequence[str]) -> Iterator[str]:
        yield f"`pebble install {' '.join(missing)}`"


class Mesh:
    """A bridge process on every hub that receives topics."""

    settings = frozenset({"heartbeat_hz"})
    needs = None
    discovery = Discovery("239.255.7.7", forget_factor=3)
    memory_mb = 10
    offsets = (50,)
    relays = False
    only_receivers = True

    def reaches(self, island: Island) -> bool:
        return True

    def listeners(self, spec: Spec, island: Island) -> Iterator[Listener]:
        yield Listener(island.hub, island.master_port + 50, "the mesh", ("multimaster", "provider"))

    def ports(self, swarm: Swarm, island: Island) -> Sequence[PortRange]:
        port = island.master_port + 50
        return (PortRange("tcp", port, port),)

    def parts(self, swarm: Swarm, host: Host, island: Island) -> Iterator[Part]:
        lines = [
            f"{origin} {topic}\n"
            for origin, topics in swarm.received[island.name].items()
            for topic in topics
        ]
        file = File("mesh/topics.txt", "".join(lines).encode())
        yield Part((file,))
        yield _unit(swarm, names.MULTIMASTER, (file.path,))

    def nodes(self, swarm: Swarm, island: Island) -> JoinNodes:
        return JoinNodes((f"/mesh_{island.hub}",), reporter=f"/mesh_{island.hub}")


PEBBLE, MESH = Pebble(), Mesh()


class Watched(Filtered):
    """What `filtered` has, and on each host a unit that watches its peers."""

    def parts(self, swarm: Swarm, host: Host) -> Iterator[Part]:
        yield from super().parts(swarm, host)
        peers = " ".join(sorted(swarm.peers.get(host.name, ())))
        listed = File("watch/peers.txt", peers.encode(), origin="security")
        yield Part((listed,))
        yield _unit(swarm, "watchd", (listed.path,))


WATCHED = Watched()
