"""The keys of a spec as frozen models: what may be written; rules check what fits together."""

from __future__ import annotations

from enum import Enum
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, RootModel, Tag

from swarmctl.field_types import (
    NO_VARS,
    Account,
    Adapter,
    Address,
    ComputerName,
    FilePath,
    Folder,
    HostName,
    IslandName,
    MasterPort,
    Model,
    Name,
    Namespace,
    PackageName,
    Parameter,
    Port,
    Printable,
    ProgramName,
    RobotName,
    RobotTypeName,
    SelectedHost,
    SelectedRobot,
    Selection,
    TimeServer,
    VariableName,
)
from swarmctl.links.link_kinds import Link
from swarmctl.plugins import MIDDLEWARES, SECURITY_LEVELS, NameIn
from swarmctl.robot_types.any_robot_type import DRIVERS, TaggedRobotType
from swarmctl.robot_types.ros_driver import DRIVER, RosDriver
from swarmctl.robot_types.settings import NO_SETTINGS, RobotSettings
from swarmctl.spec.experiment_model import Experiment
from swarmctl.spec.install_model import Install, PackageSource
from swarmctl.spec.maintenance_model import NO_TERMS, Maintenance
from swarmctl.spec.program_model import Megabytes, Program
from swarmctl.spec.reach import PORT, USER
from swarmctl.spec.ros_model import Multimaster, Ros
from swarmctl.spec.security_model import IslandSecurity, Overlay, Security, has_wireguard
from swarmctl.text_patterns import matching
from swarmctl.units import Unit

Coordinate = Annotated[float, Field(ge=-10_000, le=10_000), Unit("m")]


class Mode(str, Enum):
    """The five working modes of a heterogeneous swarm."""

    SINGLE_MINDED = "single-minded"
    LEADER = "leader"
    CENTRAL = "central"
    STANDALONE = "standalone"
    COMBINED = "combined"


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
        USER,
        description="Account to log in as; root, or one with password-free sudo. "
        "Wins over `User` in ~/.ssh/config.",
    )
    port: Port = Field(PORT, description="TCP port of its SSH server. Wins over `Port` in ~/.ssh/config.")
    computer: ComputerName | None = Field(None, description="What kind of computer it is (see `computers`).")
    bluetooth: tuple[Adapter, ...] = Field((), description="Its Bluetooth adapters.")
    has: tuple[Name, ...] = Field(
        (),
        examples=[["kinect", "joystick"]],
        description="What programs may need of it, in words of your own: a camera, a joystick, a GPU.",
    )
    via: HostName | None = Field(None, description="Host to jump through when it cannot be reached directly.")
    master_port: MasterPort | None = Field(
        None,
        examples=[11312],
        description="TCP port of the ROS master, if this host runs one; `ros.master_port` by default.",
    )
    workspaces: tuple[Folder, ...] = Field(
        (),
        examples=[["/home/robot/nav_ws", "/home/robot/catkin_ws"]],
        description="Its catkin workspaces, built; a package in the first hides those behind. "
        "`ros.workspace` by default.",
    )
    install: Install = Field(
        default_factory=Install,
        description="What `swarmctl prepare` installs on it beside what robots and programs need.",
    )
    labels: tuple[Name, ...] = Field(
        (), examples=[["lab1"]], description="Words of your own that select it, as `@lab1`."
    )
    optional: bool = Field(False, description="Whether the swarm is complete without it.")
    vars: dict[VariableName, Parameter] = Field(
        default_factory=lambda: NO_VARS,
        description="Values of variables at this host, its robots, links and programs.",
        examples=[{"map": "hall"}],
    )


class StartPose(Model):
    """Where a robot stands when its driver starts, in the frame `map`."""

    x: Coordinate = Field(examples=[0.5], description="Along the x axis of the map.")
    y: Coordinate = Field(examples=[-0.3], description="Along the y axis of the map.")
    heading_deg: Annotated[float, Unit("deg")] = Field(
        0.0, ge=-360, le=360, examples=[90], description="Where it looks, counter-clockwise from the x axis."
    )


#: Tag of a driver that is a name; brackets mark a step that is in no file.
DRIVER_NAME = "[name]"


def _driver_form(value: Any) -> str:
    return DRIVER if isinstance(value, (dict, RosDriver)) else DRIVER_NAME


class Robot(Model):
    """A robot: what it is, and which host drives it."""

    type: RobotTypeName = Field(description="Robot type, from the catalog or from `types`.")
    host: HostName | None = Field(
        None, description="The host that drives it; in mode single-minded the leader by default."
    )
    namespace: Namespace | None = Field(
        None,
        examples=["lab/k3"],
        description="Its ROS namespace, without a slash in front; by default its name, with _ for each -. "
        "Its topics, nodes and frames begin with it.",
    )
    labels: tuple[Name, ...] = Field(
        (), examples=[["lab1"]], description="Words of your own that select it, as `@lab1`."
    )
    optional: bool = Field(False, description="Whether the swarm is complete without it.")
    driver: (
        Annotated[
            Annotated[str, NameIn(DRIVERS), Tag(DRIVER_NAME)] | Annotated[RosDriver, Tag(DRIVER)],
            Discriminator(_driver_form),
        ]
        | None
    ) = Field(
        None,
        examples=["swarmctl"],
        description="Who drives it: `swarmctl`, a driver of the catalog such as `rosserial_python`, or a ROS "
        "package with its own executable or launch file; by default the driver of its type.",
    )
    settings: RobotSettings = Field(
        default_factory=lambda: NO_SETTINGS, description="What differs from its type."
    )
    maintenance: Maintenance = Field(
        default_factory=lambda: NO_TERMS,
        description="When swarmctl may stop or restart its units; wins over `maintenance` of the swarm.",
    )
    urdf: FilePath | None = Field(
        None,
        examples=["urdf/k3.urdf"],
        description="A URDF beside the spec, by its path from the spec's folder: its `robot_description`. By "
        "default that of its type.",
    )
    start: StartPose | None = Field(
        None,
        description="Where it stands when its driver starts. Its driver, or the gate in front of a ROS "
        "package, publishes the transform from `map` to its odometry frame, so that RViz shows all robots in "
        "one frame.",
    )
    vars: dict[VariableName, Parameter] = Field(
        default_factory=lambda: NO_VARS,
        description="Values of variables at this robot, its link and programs; these win over its host's.",
        examples=[{"speed": 0.3}],
    )


class Control(Model):
    """Who may command whom."""

    by: Name = Field(description="The program, robot or host that commands.", examples=["joystick"])
    of: tuple[SelectedRobot, ...] = Field(
        min_length=1, description="The robots it commands, or selections of them."
    )
    priority: int = Field(
        0, ge=0, le=255, description="Who wins when several command the same robot; higher wins."
    )


class Island(Model):
    """Hosts that share one ROS graph, in mode `combined`."""

    mode: Literal["single-minded", "leader", "central"] = Field(
        description="How this island works.", examples=["central"]
    )
    hosts: tuple[SelectedHost, ...] = Field(
        min_length=1, description="The hosts in it, or selections of them."
    )
    leader: HostName | None = Field(None, description="Its leader (modes single-minded and leader).")
    hub: HostName | None = Field(None, description="The host that runs its master (mode central).")
    security: IslandSecurity | None = Field(
        None, description="Its own `security`; that of the swarm by default."
    )
    distro: Annotated[str, NameIn(MIDDLEWARES)] | None = Field(
        None,
        description="Its own ROS distribution; that of `ros` by default. Islands of ROS 1 and ROS 2 are "
        "joined by a relay on the hub of the latter.",
        examples=["jazzy"],
    )


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

    rule: Annotated[
        str,
        matching(
            r"^[A-Z]{2,8}[0-9]{3}$",
            "a rule id has the form SET001; `swarmctl rules` lists them",
            examples=["SET001"],
        ),
    ] = Field(description="The rule, by its id.")
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
    types: dict[RobotTypeName, TaggedRobotType] = Field(
        default_factory=dict, description="Robot types beside the catalog's."
    )
    hosts: dict[HostName, Host] = Field(min_length=1, description="The computers, by name.")
    robots: dict[RobotName, Robot] = Field(
        min_length=1, description="Robots by name.", examples=[{"k3": {"type": "khepera3", "host": "k3-pi"}}]
    )
    groups: dict[Name, tuple[Selection, ...]] = Field(
        default_factory=dict,
        description="Groups of hosts and robots, by name; `@name` selects one.",
        examples=[{"epucks": ["ep-*", "type:epuck2"]}],
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
    packages: dict[PackageName, PackageSource] = Field(
        default_factory=dict,
        description="ROS packages of your own, by name, that travel with each release to the hosts of "
        "programs and robots that use them.",
        examples=[{"nav": {"from": "./src/nav"}}],
    )
    control: tuple[Control, ...] = Field((), description="Who may command whom.")
    islands: dict[IslandName, Island] = Field(
        default_factory=dict,
        description="The islands of mode combined.",
        examples=[{"west": {"mode": "central", "hosts": ["k3-pi"], "hub": "k3-pi"}}],
    )
    experiments: dict[Name, Experiment] = Field(
        default_factory=dict,
        description="What `swarmctl run` repeats, by name.",
        examples=[{"circles": {"programs": ["wander"], "duration": 60.0, "trials": 10}}],
    )
    maintenance: Maintenance = Field(
        default_factory=lambda: NO_TERMS,
        description="When `deploy`, `rollback`, `remove`, `restart` and `firmware flash` may stop or restart "
        "the units of any robot.",
    )
    security: Security = Field(
        SECURITY_LEVELS.default,
        description="`filtered`: hosts let others reach ROS only where the spec declares them to be in the "
        "same island, or to share topics with it. Each has a firewall, and its units lists of addresses. "
        "`sealed`: besides, ROS uses WireGuard between the hosts, and a key of each host proves who sends.",
        examples=["filtered", "sealed"],
    )
    overlay: Overlay | None = Field(
        None,
        description="The network of the hosts' addresses in WireGuard, with `security: sealed`. By default "
        "10.N.0.0/16, where N follows from the name of the swarm.",
        examples=["10.200.0.0/16"],
    )
    time: Time = Field(default_factory=Time, description="Whose clock the swarm follows.")
    multimaster: Multimaster | None = Field(
        None, description="How islands discover each other (modes standalone and combined)."
    )
    vars: dict[VariableName, Parameter] = Field(
        default_factory=lambda: NO_VARS,
        description="Values by name, for `${name}` in other values: text, a number, true or false, or a list "
        "of these; or a mapping of these by selections of hosts and robots, with `default` for the others.",
        examples=[{"net": "192.168.77", "speed": {"default": 0.5, "@outdoor": 1.0}}],
    )
    ignore: tuple[AcceptedFinding, ...] = Field(
        (),
        examples=[[{"rule": "SET001", "reason": "measured, and fine"}]],
        description="Findings that are known and accepted.",
    )

    @property
    def has_wireguard(self) -> bool:
        """Whether ROS uses WireGuard between the hosts."""
        return has_wireguard(self.security)
