"""The keys of a spec as frozen models: what may be written; rules check what fits together."""

from __future__ import annotations

from enum import Enum
from typing import Annotated, Literal

from pydantic import Field, RootModel

from swarmctl.field_types import (
    Account,
    Adapter,
    Address,
    Baud,
    ComputerName,
    DevicePath,
    EnvironmentKey,
    FileName,
    Folder,
    GraphName,
    HexId,
    HostName,
    IslandName,
    LaunchFile,
    Mac,
    Model,
    Name,
    NetworkName,
    PackageName,
    Port,
    Printable,
    ProgramName,
    RobotName,
    RobotTypeName,
    Subnet,
    TimeServer,
    UsbText,
    Value,
)
from swarmctl.plugins import MIDDLEWARES, NameIn
from swarmctl.robot_types.declared_topic import Topic
from swarmctl.robot_types.protocols import DriverName
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.settings import NO_SETTINGS, RobotSettings
from swarmctl.spec.multimaster_model import Multimaster
from swarmctl.units import Unit

Megabytes = Annotated[int, Unit("MB")]


class Mode(str, Enum):
    """The five working modes of a heterogeneous swarm."""

    SINGLE_MINDED = "single-minded"
    LEADER = "leader"
    CENTRAL = "central"
    STANDALONE = "standalone"
    COMBINED = "combined"


class Ros(Model):
    """Which ROS the swarm runs."""

    distro: Annotated[str, NameIn(MIDDLEWARES)] = Field(
        MIDDLEWARES.default, description="ROS distribution of every host."
    )
    master_port: Port = Field(11311, description="TCP port of each ROS master.")
    workspace: Folder | None = Field(
        None,
        description="A catkin workspace that lies on every host, built; its packages come before those "
        "of the distribution.",
    )
    naming: Literal["address", "hosts"] = Field(
        "address",
        description="What ROS nodes and masters call their host: its `address`, or its name in this spec, "
        "which /etc/hosts then resolves on every host.",
    )


class Secret(Model):
    """A secret by name; its value never stands in a spec."""

    secret: Name = Field(description="The name under which the secret is kept.", examples=["epuck-pin"])


class Computer(Model):
    """A kind of computer that hosts are made of."""

    title: Printable = Field("", description="What people call it.", examples=["Odroid XU4"])
    cores: int = Field(1, ge=1, le=1024, description="Processor cores.", examples=[4])
    memory_mb: Megabytes = Field(1024, ge=1, description="Memory.")
    clock: bool = Field(True, description="Whether it keeps the time without power (a battery-backed clock).")


class Computers(RootModel[dict[Name, Computer]]):
    """Kinds of computers by name."""


class Host(Model):
    """A computer that swarmctl logs into."""

    address: Address = Field(description="Where the others reach it; also its ROS_IP (see `ros.naming`).")
    user: Account = Field(
        "robot",
        description="Account to log in as; root, or one with password-free sudo. "
        "Wins over `User` in ~/.ssh/config.",
    )
    port: Port = Field(22, description="TCP port of its SSH server. Wins over `Port` in ~/.ssh/config.")
    computer: ComputerName | None = Field(None, description="What kind of computer it is (see `computers`).")
    bluetooth: tuple[Adapter, ...] = Field((), description="Its Bluetooth adapters.")
    has: tuple[Name, ...] = Field(
        (),
        examples=[["kinect", "joystick"]],
        description="What programs may need of it, in words of your own: a camera, a joystick, a GPU.",
    )
    via: HostName | None = Field(None, description="Host to jump through when it cannot be reached directly.")
    master_port: Port | None = Field(
        None,
        examples=[11312],
        description="TCP port of the ROS master, if this host runs one; `ros.master_port` by default.",
    )
    optional: bool = Field(False, description="Whether the swarm is complete without it.")


class Robot(Model):
    """A robot: what it is, and which host drives it."""

    type: RobotTypeName = Field(description="Robot type, from the catalog or from `types`.")
    host: HostName | None = Field(
        None, description="The host that drives it; in mode single-minded the leader by default."
    )
    optional: bool = Field(False, description="Whether the swarm is complete without it.")
    driver: DriverName = Field(
        "swarmctl",
        description="Who drives it: swarmctl's driver, or, where its board speaks rosserial, the ROS package "
        "`rosserial_python`, which obeys every publisher, makes no odometry and reads no settings.",
    )
    settings: RobotSettings = Field(
        default_factory=lambda: NO_SETTINGS, description="What differs from its type."
    )


class Usb(Model):
    """Identity of a USB serial adapter, as udev sees it."""

    serial: UsbText = Field(description="The adapter's serial number (`udevadm info -a`, ATTRS{serial}).")
    vendor: HexId | None = Field(None, description="Vendor id, four hexadecimal digits.")
    product: HexId | None = Field(None, description="Product id, four hexadecimal digits.")


class NetworkLink(Model):
    """What a wlan and an ethernet have in common."""

    kind: Literal["wlan", "ethernet"]
    name: NetworkName = Field(description="Name of the network.")
    hosts: tuple[HostName, ...] = Field(min_length=1, description="The hosts on it.")
    subnet: Subnet | None = Field(
        None, description="Its addresses; by default the /24 around the hosts' own."
    )
    multicast: bool | None = Field(None, description="Whether multicast passes; unknown when left out.")
    capacity_mbps: Annotated[float, Field(gt=0, le=100_000), Unit("Mbit/s")] | None = Field(
        None,
        examples=[35.0],
        description="Throughput between two of its hosts, as iperf3 measures it; 10 for a wlan and 90 for an "
        "ethernet by default.",
    )


class Wlan(NetworkLink):
    """A wireless network between hosts."""

    kind: Literal["wlan"] = Field(description="What kind of link this is.")
    client_isolation: bool | None = Field(
        None, description="Whether the access point keeps its clients apart."
    )


class Ethernet(NetworkLink):
    """A wired network between hosts."""

    kind: Literal["ethernet"] = Field(description="What kind of link this is.")


class Serial(Model):
    """A serial line between a host and a robot: a USB adapter by its identity, or a fixed device."""

    kind: Literal["serial"] = Field(description="What kind of link this is.")
    host: HostName = Field(description="The host at one end.")
    robot: RobotName = Field(description="The robot at the other.")
    usb: Usb | None = Field(None, description="The USB adapter; the device is then /dev/swarm/<robot>.")
    device: DevicePath | None = Field(
        None, description="A device that never changes its name, such as /dev/ttyS0."
    )
    baud: Baud | None = Field(None, description="Bits per second; the robot type's own by default.")


class Bluetooth(Model):
    """A Bluetooth serial connection (RFCOMM) between a host and a robot."""

    kind: Literal["bluetooth"] = Field(description="What kind of link this is.")
    host: HostName = Field(description="The host at one end.")
    robot: RobotName = Field(description="The robot at the other.")
    mac: Mac = Field(description="The robot's Bluetooth address, in quotes.")
    pin: Secret | None = Field(
        None, description="Pairing PIN as {secret: NAME}; a spec never contains the PIN itself."
    )
    adapter: Adapter | None = Field(None, description="Which adapter of the host; its first by default.")
    channel: int | None = Field(
        None, ge=1, le=30, examples=[1], description="RFCOMM channel; the robot type's own by default."
    )


Link = Annotated[Wlan | Ethernet | Serial | Bluetooth, Field(discriminator="kind")]
LINKS: dict[str, type[Model]] = {
    "wlan": Wlan,
    "ethernet": Ethernet,
    "serial": Serial,
    "bluetooth": Bluetooth,
}
KINDS = tuple(LINKS)


class Program(Model):
    """A ROS program of the swarm: one that swarmctl ships, a node of a package, or a launch file."""

    host: HostName | None = Field(None, description="The host it runs on.")
    robot: RobotName | None = Field(
        None,
        description="The robot in whose namespace it runs, on that robot's host unless `host` is given.",
    )
    needs: tuple[Name, ...] = Field(
        (),
        examples=[["kinect"]],
        description="What its host must have (`has` of hosts). Without `host` and `robot` it runs on the "
        "first host that has all of it.",
    )
    use: Name | None = Field(None, description="A program that swarmctl ships.", examples=["teleop-joy"])
    package: PackageName | None = Field(None, description="ROS package.")
    executable: FileName | None = Field(None, description="Executable of the package.")
    launch: LaunchFile | None = Field(
        None,
        description="Launch file in the package's folder `launch`, or in a folder of it.",
        examples=["joystick.launch"],
    )
    params: dict[str, Value] = Field(
        default_factory=dict,
        description="Private parameters; the arguments of a launch file.",
        examples=[{"device": "/dev/input/js0"}],
    )
    remap: dict[GraphName, GraphName] = Field(
        default_factory=dict, description="Names to change.", examples=[{"cmd_vel": "/k3/cmd_vel"}]
    )
    environment: dict[EnvironmentKey, Printable] = Field(
        default_factory=dict, description="Environment variables.", examples=[{"LANG": "C.UTF-8"}]
    )
    publishes: tuple[Topic, ...] = Field((), description="Topics it publishes.")
    subscribes: tuple[Topic, ...] = Field((), description="Topics it subscribes to.")
    requires: tuple[PackageName, ...] = Field(
        (), description="ROS packages without which it cannot run.", examples=[["joy"]]
    )
    board: Name | None = Field(
        None,
        description="The microcontroller it speaks rosserial with; its topics are the sketch's.",
        examples=["arduino-uno"],
    )
    memory_mb: Annotated[Megabytes, Field(ge=1, examples=[300])] | None = Field(
        None, description="Memory it takes."
    )
    optional: bool = Field(False, description="Whether the swarm is complete without it.")


class Control(Model):
    """Who may command whom."""

    by: Name = Field(description="The program, robot or host that commands.", examples=["joystick"])
    of: tuple[RobotName, ...] = Field(min_length=1, description="The robots it commands.")
    priority: int = Field(
        0, ge=0, le=255, description="Who wins when several command the same robot; higher wins."
    )


class Island(Model):
    """Hosts that share one ROS graph, in mode `combined`."""

    mode: Literal["single-minded", "leader", "central"] = Field(
        description="How this island works.", examples=["central"]
    )
    hosts: tuple[HostName, ...] = Field(min_length=1, description="The hosts in it.")
    leader: HostName | None = Field(None, description="Its leader (modes single-minded and leader).")
    hub: HostName | None = Field(None, description="The host that runs its master (mode central).")


class Time(Model):
    """Whose clock the swarm follows. Transforms and multimaster discovery need clocks that agree."""

    root: HostName | None = Field(
        None,
        description="The host whose clock the others follow; the hub by default where there is one.",
    )
    servers: tuple[TimeServer, ...] = Field(
        (),
        examples=[["ntp.lab.example"]],
        description="NTP servers that the root follows while it can reach them.",
    )


class AcceptedFinding(Model):
    """A finding that is known and accepted."""

    rule: Annotated[str, Field(pattern=r"^[A-Z]{2,8}[0-9]{3}$", examples=["SET001"])] = Field(
        description="The rule, by its id."
    )
    about: Name | None = Field(
        None,
        examples=["k3-pi"],
        description="Only findings that name this host, robot, program or network; all when left out.",
    )
    reason: Annotated[Printable, Field(min_length=3)] = Field(
        examples=["measured, and fine"], description="Why it is accepted."
    )


class HostDefaults(Model):
    """Defaults for all hosts."""

    user: Account | None = Field(None, description="Account to log in as.")
    port: Port | None = Field(None, description="TCP port of the SSH server.", examples=[2222])
    computer: ComputerName | None = Field(None, description="What kind of computer it is.")


class Defaults(Model):
    """Defaults for every host or robot."""

    host: HostDefaults = Field(default_factory=HostDefaults, description="For every host.")
    robot: RobotSettings = Field(
        default_factory=lambda: NO_SETTINGS, description="For every robot, below types."
    )


class Spec(Model):
    """One swarm: its robots, its hosts, the links between them and the mode in which they work together."""

    include: str | tuple[str, ...] = Field(
        (),
        description="Files that hold more of this spec, from the folder it lies in.",
        examples=[["hosts.yaml", "robots/lab.yaml"]],
    )
    version: Literal[1] = Field(description="Version of the spec format.")
    name: Name = Field(
        description="The swarm's name; its folder on every host is /opt/swarm/<name>.", examples=["newswarm"]
    )
    mode: Mode = Field(description="How the robots work together.", strict=False, examples=["leader"])
    leader: HostName | None = Field(None, description="The leading host (modes single-minded and leader).")
    hub: HostName | None = Field(None, description="The host that runs the master (mode central).")
    ros: Ros = Field(default_factory=Ros, description="Its ROS: distribution and master port.")
    defaults: Defaults = Field(default_factory=Defaults, description="Defaults of hosts and robots.")
    computers: dict[Name, Computer] = Field(
        default_factory=dict,
        description="Kinds of computers beside the known ones.",
        examples=[{"odroid-xu4": {"title": "Odroid XU4", "cores": 8, "memory_mb": 2048, "clock": False}}],
    )
    types: dict[RobotTypeName, RobotType] = Field(
        default_factory=dict, description="Robot types beside the catalog's."
    )
    hosts: dict[HostName, Host] = Field(min_length=1, description="The computers, by name.")
    robots: dict[RobotName, Robot] = Field(
        min_length=1, description="Robots by name.", examples=[{"k3": {"type": "khepera3", "host": "k3-pi"}}]
    )
    links: tuple[Link, ...] = Field(
        (),
        description="Networks between hosts, lines between hosts and robots.",
        examples=[[{"kind": "serial", "host": "k3-pi", "robot": "k3", "usb": {"serial": "FTDI1234"}}]],
    )
    programs: dict[ProgramName, Program] = Field(
        default_factory=dict,
        description="ROS programs, by name.",
        examples=[{"joystick": {"host": "koala-laptop", "use": "teleop-joy"}}],
    )
    control: tuple[Control, ...] = Field((), description="Who may command whom.")
    islands: dict[IslandName, Island] = Field(
        default_factory=dict,
        description="The islands of mode combined.",
        examples=[{"west": {"mode": "central", "hosts": ["k3-pi"], "hub": "k3-pi"}}],
    )
    time: Time = Field(default_factory=Time, description="Whose clock the swarm follows.")
    multimaster: Multimaster | None = Field(
        None, description="How islands discover each other (modes standalone and combined)."
    )
    silence: tuple[AcceptedFinding, ...] = Field(
        (),
        examples=[[{"rule": "SET001", "reason": "measured, and fine"}]],
        description="Findings that are known and accepted.",
    )
