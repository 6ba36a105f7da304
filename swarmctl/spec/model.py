"""The whole vocabulary of a spec as frozen models: what may be written, not what makes sense together."""

from __future__ import annotations

import ipaddress
import re
from enum import Enum
from typing import Annotated, Any, Literal, get_args, get_origin

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    RootModel,
    ValidationError,
    ValidatorFunctionWrapHandler,
    WrapValidator,
)

from swarmctl.spec.robot_type import RobotSettings, RobotType

SPEC_VERSION = 1

_HOSTNAME = re.compile(
    r"(?=.{1,253}$)(?!-)[A-Za-z0-9-]{1,63}(?<!-)(\.(?!-)[A-Za-z0-9-]{1,63}(?<!-))*", re.ASCII
)
_MAC = re.compile(r"[0-9a-fA-F]{2}(:[0-9a-fA-F]{2}){5}", re.ASCII)
_ADDRESS_HINT = "four numbers up to 255 without leading zeros, like 192.168.77.10, or a name like k3-pi.local"


def _address(value: str) -> str:
    """An IP address or a host name; its last label starts with a letter, as 127.1 is an address to libc."""
    try:
        ipaddress.ip_address(value)
    except ValueError:
        if not _HOSTNAME.fullmatch(value) or not value.rpartition(".")[2][:1].isalpha():
            raise ValueError(f"`{value}` is neither an IP address nor a host name; {_ADDRESS_HINT}") from None
        return value
    if "%" in value:
        raise ValueError("an address carries no interface; drop what follows `%`")
    return value


def _mac(value: str) -> str:
    if not _MAC.fullmatch(value):
        raise ValueError(f"`{value}` is not a Bluetooth address; write six pairs, like 10:00:e8:c5:64:37")
    return value.lower()


def _subnet(value: str) -> str:
    try:
        return str(ipaddress.ip_network(value))
    except ValueError:
        pass
    try:
        meant = str(ipaddress.ip_interface(value).network)
    except ValueError:
        meant = "192.168.77.0/24"
    raise ValueError(f"`{value}` is not a subnet; write it like {meant}")


def _device_path(value: str) -> str:
    if not re.fullmatch(r"/dev/[A-Za-z0-9._/-]+", value, re.ASCII) or ".." in value:
        raise ValueError(f"`{value}` is not a device path; write it like /dev/ttyS0")
    if value.startswith("/dev/swarm/"):
        raise ValueError(
            f"`{value}` is a name that swarmctl gives; say which adapter it is: usb: {{serial: ...}}"
        )
    return value


Name = Annotated[
    str,
    Field(
        pattern=r"^[a-z][a-z0-9-]{0,30}$",
        description="Lower-case letters, digits and hyphens, a letter first.",
    ),
]
HostName = Annotated[Name, Field(examples=["k3-pi"])]
RobotName = Annotated[Name, Field(examples=["k3"])]
RobotTypeName = Annotated[Name, Field(examples=["khepera3"])]
ComputerName = Annotated[Name, Field(examples=["raspberry-pi-4b"])]
NetworkName = Annotated[Name, Field(examples=["lab"])]
ProgramName = Annotated[Name, Field(examples=["joystick"])]
Address = Annotated[str, Field(examples=["192.168.77.10"]), AfterValidator(_address)]
Mac = Annotated[str, Field(examples=["10:00:e8:c5:64:37"]), AfterValidator(_mac)]
Subnet = Annotated[str, Field(examples=["192.168.77.0/24"]), AfterValidator(_subnet)]
DevicePath = Annotated[str, Field(examples=["/dev/ttyS0"]), AfterValidator(_device_path)]
Adapter = Annotated[str, Field(pattern=r"^hci[0-9]{1,2}$", examples=["hci0"])]
Account = Annotated[str, Field(pattern=r"^[a-z_][a-z0-9_-]{0,31}$", examples=["robot"])]
Port = Annotated[int, Field(ge=1, le=65535)]
Baud = Annotated[int, Field(ge=300, le=4_000_000, examples=[115200])]
UsbText = Annotated[str, Field(pattern=r"^[A-Za-z0-9:._-]{1,64}$", examples=["FTDI1234"])]
# The kernel writes these ids in lower case, and udev compares letter by letter.
HexId = Annotated[str, Field(pattern=r"^[0-9a-fA-F]{4}$", examples=["0403"]), AfterValidator(str.lower)]
GraphName = Annotated[
    str,
    Field(
        pattern=r"^[A-Za-z~/][A-Za-z0-9_/]*$",
        max_length=200,
        description="A ROS graph name.",
        examples=["cmd_vel"],
    ),
]
TypeName = Annotated[
    str, Field(pattern=r"^[a-z][a-z0-9_]*/[A-Z][A-Za-z0-9]*$", examples=["geometry_msgs/Twist"])
]
PackageName = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", examples=["joy"])]
FileName = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]*$", examples=["joy_node"])]
EnvironmentKey = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$")]
Printable = Annotated[
    str, Field(pattern=r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029\ufffe\uffff]*$", max_length=4096)
]


def _one_word(value: Any, inner: ValidatorFunctionWrapHandler) -> Any:
    """One complaint where a union would bring one for each of its members."""
    try:
        return inner(value)
    except ValidationError:
        raise ValueError("a parameter is text, a number, true or false") from None


Value = Annotated[bool | int | float | Printable, WrapValidator(_one_word)]


class Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class Mode(str, Enum):
    """The five working modes of a heterogeneous swarm."""

    SINGLE_MINDED = "single-minded"
    LEADER = "leader"
    CENTRAL = "central"
    STANDALONE = "standalone"
    COMBINED = "combined"


class Ros(Model):
    """Which ROS the swarm runs."""

    distro: Literal["noetic"] = Field("noetic", description="ROS distribution of every host.")
    master_port: Port = Field(11311, description="TCP port of each ROS master.")


class Secret(Model):
    """A secret by name; its value never stands in a spec."""

    secret: Name = Field(description="The name under which the secret is kept.", examples=["epuck-pin"])


class Computer(Model):
    """A kind of computer that hosts are made of."""

    title: Printable = Field("", description="What people call it.", examples=["Odroid XU4"])
    cores: int = Field(1, ge=1, le=1024, description="Processor cores.", examples=[4])
    memory_mb: int = Field(1024, ge=1, description="Memory in MB.")
    clock: bool = Field(True, description="Whether it keeps the time without power (a battery-backed clock).")


class Computers(RootModel[dict[Name, Computer]]):
    """Kinds of computers by name."""


class Host(Model):
    """A computer that swarmctl logs into."""

    address: Address = Field(description="Where the others reach it; also its ROS_IP.")
    user: Account = Field("robot", description="Account to log in as; root, or one with password-free sudo.")
    port: Port = Field(22, description="TCP port of its SSH server.")
    computer: ComputerName | None = Field(None, description="What kind of computer it is (see `computers`).")
    bluetooth: tuple[Adapter, ...] = Field((), description="Its Bluetooth adapters.")
    via: HostName | None = Field(None, description="Host to jump through when it cannot be reached directly.")
    optional: bool = Field(False, description="Whether the swarm is complete without it.")


class Robot(Model):
    """A robot: what it is, and which host drives it."""

    type: RobotTypeName = Field(description="Robot type, from the catalog or from `types`.")
    host: HostName | None = Field(
        None, description="The host that drives it; in mode single-minded the leader by default."
    )
    optional: bool = Field(False, description="Whether the swarm is complete without it.")
    settings: RobotSettings = Field(default_factory=RobotSettings, description="What differs from its type.")


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
        None, description="Pairing PIN as {secret: NAME}; the PIN itself stands in no spec."
    )
    adapter: Adapter | None = Field(None, description="Which adapter of the host; its first by default.")
    channel: int | None = Field(
        None, ge=1, le=30, examples=[1], description="RFCOMM channel; the robot type's own by default."
    )


Link = Annotated[Wlan | Ethernet | Serial | Bluetooth, Field(discriminator="kind")]
_LINKS: dict[str, type[BaseModel]] = {
    "wlan": Wlan,
    "ethernet": Ethernet,
    "serial": Serial,
    "bluetooth": Bluetooth,
}
KINDS = tuple(_LINKS)


class Topic(Model):
    """A topic that a program publishes or hears."""

    topic: GraphName = Field(description="Its ROS name.")
    type: TypeName = Field(description="Its message type.")


class Program(Model):
    """A ROS program of the swarm: one that swarmctl ships, a node of a package, or a launch file."""

    host: HostName | None = Field(None, description="The host it runs on.")
    robot: RobotName | None = Field(
        None, description="The robot whose host it runs on, in that robot's namespace."
    )
    use: Name | None = Field(None, description="A program that swarmctl ships.", examples=["teleop-joy"])
    package: PackageName | None = Field(None, description="ROS package.")
    executable: FileName | None = Field(None, description="Executable of the package.")
    launch: FileName | None = Field(
        None, description="Launch file of the package.", examples=["joystick.launch"]
    )
    params: dict[str, Value] = Field(
        default_factory=dict, description="Private parameters.", examples=[{"device": "/dev/input/js0"}]
    )
    remap: dict[GraphName, GraphName] = Field(
        default_factory=dict, description="Names to change.", examples=[{"cmd_vel": "/k3/cmd_vel"}]
    )
    environment: dict[EnvironmentKey, Printable] = Field(
        default_factory=dict, description="Environment variables.", examples=[{"LANG": "C.UTF-8"}]
    )
    publishes: tuple[Topic, ...] = Field((), description="Topics it publishes.")
    subscribes: tuple[Topic, ...] = Field((), description="Topics it hears.")
    requires: tuple[str, ...] = Field(
        (), description="ROS packages without which it cannot run.", examples=[["joy"]]
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


class HostDefaults(Model):
    user: Account | None = Field(None, description="Account to log in as.")
    port: Port | None = Field(None, description="TCP port of the SSH server.", examples=[2222])
    computer: ComputerName | None = Field(None, description="What kind of computer it is.")


class Defaults(Model):
    """What holds for every host or robot that does not say otherwise."""

    host: HostDefaults = Field(default_factory=HostDefaults, description="For every host.")
    robot: RobotSettings = Field(
        default_factory=RobotSettings, description="For every robot, below its type's own."
    )


class Spec(Model):
    """One swarm: its robots, its hosts, the links between them and the mode in which they work together."""

    version: Literal[1] = Field(description="Version of the spec's vocabulary.")
    name: Name = Field(
        description="The swarm's name; its folder on every host is /opt/swarm/<name>.", examples=["newswarm"]
    )
    mode: Mode = Field(description="How the robots work together.", strict=False, examples=["leader"])
    leader: HostName | None = Field(None, description="The leading host (modes single-minded and leader).")
    hub: HostName | None = Field(None, description="The host that runs the master (mode central).")
    ros: Ros = Field(default_factory=Ros, description="Its ROS: distribution and master port.")
    defaults: Defaults = Field(default_factory=Defaults, description="What holds where nothing else is said.")
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
        min_length=1,
        description="The robots, by name.",
        examples=[{"k3": {"type": "khepera3", "host": "k3-pi"}}],
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
    islands: dict[Name, Island] = Field(
        default_factory=dict,
        description="The islands of mode combined.",
        examples=[{"west": {"mode": "central", "hosts": ["k3-pi"], "hub": "k3-pi"}}],
    )


def known_keys(loc: tuple[str | int, ...], model: type[BaseModel] = Spec) -> tuple[str, ...]:
    """The keys that may stand at ``loc`` of a ``model`` (union tags in ``loc`` as pydantic reports them)."""
    places = _places(loc, model)
    return tuple(dict.fromkeys(name for place in places if _is_model(place) for name in place.model_fields))


def _places(loc: tuple[str | int, ...], model: type[BaseModel]) -> list[Any]:
    """The types that stand at ``loc`` of a ``model``."""
    places: list[Any] = [model]
    for part in loc:
        if _LINKS.get(str(part)) in places:  # a union tag: it chooses, and leads no further
            places = [_LINKS[str(part)]]
        else:
            places = [below for place in places for below in _below(place, part)]
    return places


def link_keys(kind: str) -> tuple[str, ...]:
    """The keys of one kind of link."""
    return tuple(_LINKS[kind].model_fields)


def described(loc: tuple[str | int, ...], model: type[BaseModel] = Spec) -> str:
    """What the key at ``loc`` of a ``model`` is for; nothing where the models do not say."""
    fields = [place.model_fields.get(str(loc[-1])) for place in _places(loc[:-1], model) if _is_model(place)]
    return next((field.description for field in fields if field and field.description), "")


def _is_model(place: Any) -> bool:
    return isinstance(place, type) and issubclass(place, BaseModel)


def _below(place: Any, part: str | int) -> list[Any]:
    """What type annotations stand one step below ``place``."""
    if _is_model(place):
        field = place.model_fields.get(part)
        return _unwrapped(field.annotation) if field else []
    origin, arguments = get_origin(place), get_args(place)
    if origin is dict:
        return _unwrapped(arguments[1])
    if origin in (tuple, list):
        return _unwrapped(arguments[0])
    return []


def _unwrapped(annotation: Any) -> list[Any]:
    """The alternatives of an annotation, without ``Annotated`` and ``| None``."""
    if hasattr(annotation, "__metadata__"):
        return _unwrapped(annotation.__origin__)
    if getattr(annotation, "__origin__", None) in (tuple, list, dict):
        return [annotation]
    arguments = getattr(annotation, "__args__", None)
    if arguments:
        return [one for argument in arguments if argument is not type(None) for one in _unwrapped(argument)]
    return [annotation]
