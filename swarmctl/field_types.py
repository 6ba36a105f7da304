"""Types of single values: names, addresses, ports, ROS names."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    PlainValidator,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue

from swarmctl.text_patterns import matching
from swarmctl.units import Unit

_HOSTNAME = re.compile(
    r"(?=.{1,253}$)(?!-)[A-Za-z0-9-]{1,63}(?<!-)(\.(?!-)[A-Za-z0-9-]{1,63}(?<!-))*", re.ASCII
)
_NO_LINE = re.compile(
    "/dev/(null|zero|full|u?random|k?mem|console|tty[0-9]*|(sd|nvme|mmcblk|input|hid|video|bus).*)"
)
_PLACEHOLDER = re.compile(
    r"to-?do|tbd|fixme|change-?me|placeholder|xxx|([0-9]{1,3}|x{1,3})(\.([0-9]{1,3}|x{1,3})){3}",
    re.ASCII | re.IGNORECASE,
)
_MAC = re.compile(r"[0-9a-fA-F]{2}(:[0-9a-fA-F]{2}){5}", re.ASCII)
RADIO_RATES = {"250K": 250_000, "1M": 1_000_000, "2M": 2_000_000}  # bits per second on the air
RADIO_ADDRESS = "E7E7E7E7E7"  # of a Crazyflie as it leaves the factory
LAST_CHANNEL = 125  # 2400 MHz and 1 MHz more for each channel (nRF24LU1+ product specification)
LAST_DONGLE = 15  # crazyflie_cpp has places for 16
_RADIO = re.compile(r"radio://([0-9]{1,4})/([0-9]{1,4})/([^/]+)(?:/([^/]*))?", re.ASCII)
_RADIO_EXAMPLE = f"radio://0/80/2M/{RADIO_ADDRESS}"
_ADDRESS_HINT = "four numbers up to 255 without leading zeros, like 192.168.77.10, or a name like k3-pi.local"

_BESIDE_ADDRESSES = (  # what people write along with an address
    (r"[{$<\[]", "a spec has no variables or placeholders; write the address itself"),
    ("//", "leave out what stands before the name of the host, and behind it"),
    ("@", "write the account under `user`, and only the address here"),
    ("/", "write the size of the network in its link, as `subnet`"),
    ("^[^:]+:[0-9]+$", "write only the address here; the port of an SSH server is the `port` of its host"),
    ("_", "names of hosts have letters, digits, hyphens and dots"),
)


def _address(value: str) -> str:
    """An IP address or a host name; its last label starts with a letter, as 127.1 is an address to libc."""
    try:
        ipaddress.ip_address(value)
    except ValueError:
        if not _HOSTNAME.fullmatch(value) or not value.rpartition(".")[2][:1].isalpha():
            hint = next(
                (hint_text for form, hint_text in _BESIDE_ADDRESSES if re.search(form, value)), _ADDRESS_HINT
            )
            raise ValueError(f"`{value}` is neither an IP address nor a host name; {hint}") from None
        if _PLACEHOLDER.fullmatch(value):
            raise ValueError(
                f"`{value}` is a placeholder; write the address, which `hostname -I` shows on the host"
            ) from None
        return value
    if "%" in value:
        raise ValueError("an address carries no interface; drop what follows `%`")
    return value


def _time_server(value: str) -> str:
    """The address of an NTP server, which has no port and no account of its own."""
    if re.search("^[^:]+:[0-9]+$", value):
        raise ValueError(f"`{value}` has a port; write only the address: NTP always uses port 123")
    return _address(value)


def _mac(value: str) -> str:
    if not _MAC.fullmatch(value):
        raise ValueError(f"`{value}` is not a Bluetooth address; write six pairs, like 10:00:e8:c5:64:37")
    return value.lower()


def _no_path(value: str) -> str:
    if value.startswith("/dev/"):
        raise ValueError(
            f"`{value}` is a device, which may get another name at the next start; "
            f"write what `udevadm info -a {value}` shows as ATTRS{{serial}}"
        )
    return value


def _robot_address(value: str) -> str:
    """The address of a robot's own network interface: IPv4, or a name that its host resolves."""
    try:
        ip = ipaddress.ip_address(value)
    except ValueError:
        if _PLACEHOLDER.fullmatch(value):
            raise ValueError(f"`{value}` is a placeholder; write the address of the robot") from None
        return _address(value)
    if ip.version == 6:
        raise ValueError(f"`{value}` is an IPv6 address; write the IPv4 address of the robot")
    if ip.is_unspecified or ip.is_multicast or int(ip) >> 28 == 0xF:
        raise ValueError(f"`{value}` is not an address of a robot; write the one that its host reaches it at")
    return value


def _radio_uri(value: str) -> str:
    """The URI of a Crazyflie's radio link in its full form: address included, upper case behind `radio:`."""
    found = _RADIO.fullmatch(value)
    if found is None:
        raise ValueError(
            f"`{value}` is not a URI of a radio; write dongle, channel, data rate and address "
            f"like {_RADIO_EXAMPLE}"
        )
    dongle, channel, rate, address = found.groups()
    if int(dongle) > LAST_DONGLE:
        raise ValueError(f"a host has the dongles 0 to {LAST_DONGLE}, not {dongle}")
    if int(channel) > LAST_CHANNEL:
        raise ValueError(f"a Crazyradio has the channels 0 to {LAST_CHANNEL}, not {channel}")
    if rate.upper() not in RADIO_RATES:
        raise ValueError(f"`{rate}` is not a data rate of a Crazyradio; write {', '.join(RADIO_RATES)}")
    if address is not None and not re.fullmatch("[0-9a-fA-F]{10}", address):
        raise ValueError(
            f"`{address}` is not a radio address; write ten hexadecimal digits like {RADIO_ADDRESS}"
        )
    return f"radio://{int(dongle)}/{int(channel)}/{rate.upper()}/{(address or RADIO_ADDRESS).upper()}"


def _group(value: str) -> str:
    try:
        if ipaddress.IPv4Address(value).is_multicast:
            return value
    except ValueError:
        pass
    raise ValueError(f"`{value}` is not a multicast address; write one from 224.0.0.0 to 239.255.255.255")


def _subnet(value: str) -> str:
    try:
        if "/" in value:
            return str(ipaddress.ip_network(value))
    except ValueError:
        pass
    try:
        prefix = "" if "/" in value else "/24"
        meant = str(ipaddress.ip_interface(value + prefix).network)
    except ValueError:
        meant = "192.168.77.0/24"
    raise ValueError(f"`{value}` is not a subnet; write it like {meant}")


def _device_path(value: str) -> str:
    if not re.fullmatch(r"/dev/[A-Za-z0-9._/:+=@,~-]+", value, re.ASCII) or ".." in value.split("/"):
        raise ValueError(f"`{value}` is not a device path; write it like /dev/ttyS0")
    if _NO_LINE.fullmatch(value):
        raise ValueError(f"`{value}` is not a serial line; write one such as /dev/ttyS0 or /dev/ttyAMA0")
    if value.startswith("/dev/swarm/"):
        raise ValueError(
            f"`{value}` is a name that swarmctl assigns; identify the adapter instead: usb: {{serial: ...}}"
        )
    return value


KEY = "[key]"  # the last step to a name itself, not to what it names; pydantic's own word


class ConsistencyError(ValueError):
    """Parts that are right by themselves and do not fit together; ``at`` leads to the one to look at."""

    def __init__(self, message: str, *at: str | int) -> None:
        super().__init__(message)
        self.at = at
        self.parts = frozenset(at[:1])  # keys of the model that do not fit together
        self.others: tuple[ConsistencyError, ...] = ()  # of the same model


Find = Callable[[Any], Iterable[ConsistencyError]]


def fits_together(find: Find) -> Any:
    """Makes a method that yields errors, causes first, a validator: it raises the first one with the others.

    Of several errors at one place the first counts. The validation's context may be a set of such methods,
    which then raise nothing; those that raise are added.
    """

    def check(self: Any, info: ValidationInfo) -> Any:
        known = info.context if isinstance(info.context, set) else set[Find]()
        found: dict[tuple[str | int, ...], ConsistencyError] = {}
        for error in find(self) if find not in known else ():
            found.setdefault(error.at, error)
        if found:
            known.add(find)
            first, *others = found.values()
            first.others = tuple(others)
            raise first
        return self

    return model_validator(mode="after")(check)


class Model(BaseModel):
    """A part of a file: it does not change, has no keys but its own, and no value becomes another type's."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


NAME = r"^[a-z][a-z0-9-]{0,30}$"
Name = Annotated[str, matching(
    NAME, "names are lower-case letters, digits and hyphens, a letter first, 31 at most",
    description="Lower-case letters, digits and hyphens, a letter first.",
)]  # fmt: skip


HostName = Annotated[Name, Field(examples=["k3-pi"])]
RobotName = Annotated[Name, Field(examples=["k3"])]
ROBOT_TYPE_NAME = r"^[a-z][a-z0-9.-]{0,30}$"
RobotTypeName = Annotated[str, matching(
    ROBOT_TYPE_NAME, "robot types are lower-case letters, digits, dots and hyphens, a letter first",
    examples=["khepera3"], description="Lower-case letters, digits, dots and hyphens, a letter first.",
)]  # fmt: skip
ComputerName = Annotated[Name, Field(examples=["raspberry-pi-4b"])]
X_SELECTION = "x-selection"  # the word of a JSON Schema for a name in whose place a selection may stand


class Selectable:
    """Marks the names of a list in which selections may stand; the model has what these mean."""

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Notes it for the schema of a file, in which selections are written."""
        return {**handler(schema), X_SELECTION: True}


SelectedHost = Annotated[HostName, Selectable()]
SelectedRobot = Annotated[RobotName, Selectable()]
Selection = Annotated[
    str,
    Field(
        max_length=4096,
        description="Hosts and robots: ep-*, ep-[1-6], @lab, type:epuck2, host:k3-pi, a&b, !c.",
        examples=["ep-*"],
    ),
]
NetworkName = Annotated[Name, Field(examples=["lab"])]
IslandName = Annotated[Name, Field(examples=["west"])]
ProgramName = Annotated[Name, Field(examples=["joystick"])]
Address = Annotated[str, Field(examples=["192.168.77.10"]), AfterValidator(_address)]
RobotAddress = Annotated[str, Field(examples=["192.168.10.1"]), AfterValidator(_robot_address)]
RadioUri = Annotated[str, Field(examples=[_RADIO_EXAMPLE]), AfterValidator(_radio_uri)]
TimeServer = Annotated[str, Field(examples=["ntp.lab.example"]), AfterValidator(_time_server)]
Mac = Annotated[str, Field(examples=["10:00:e8:c5:64:37"]), AfterValidator(_mac)]
Subnet = Annotated[str, Field(examples=["192.168.77.0/24"]), AfterValidator(_subnet)]
Folder = Annotated[str, matching(
    r"^(/[A-Za-z0-9_][A-Za-z0-9._-]*)+$", "write the whole path of the folder, like /home/robot/catkin_ws",
    max_length=255, examples=["/home/robot/catkin_ws"],
)]  # fmt: skip
DevicePath = Annotated[str, Field(examples=["/dev/ttyS0"]), AfterValidator(_device_path)]
ADAPTER = r"^hci[0-9]{1,2}$"
Adapter = Annotated[str, matching(ADAPTER, "adapters are called hci0, hci1, ...", examples=["hci0"])]
# As systemd takes them (User= and usernames in systemd.io): accounts of a directory have dots and upper case.
# Without `$` and `@`, which are a machine's account, or the host as in `user@host`.
Account = Annotated[str, matching(
    r"^[A-Za-z_][A-Za-z0-9_.-]{0,31}$", "accounts are letters, digits and _ . -, a letter or _ first",
    examples=["robot"],
)]  # fmt: skip
Port = Annotated[int, Field(ge=1, le=65535)]
# Units run without privileges, and the port of the discovery is 300 above that of the master.
MasterPort = Annotated[int, Field(ge=1024, le=65235)]
Group = Annotated[str, Field(examples=["226.0.0.0"]), AfterValidator(_group)]
SystemId = Annotated[int, Field(
    ge=1, le=255, examples=[2],
    description="The vehicle's MAVLink system id, as its autopilot has it: MAV_SYS_ID of a PX4, "
    "SYSID_THISMAV of an ArduPilot.",
)]  # fmt: skip
Baud = Annotated[int, Field(ge=300, le=4_000_000, examples=[115200]), Unit("baud")]
# A device writes any text here; what would be a pattern or a quote in a udev rule is left out.
UsbText = Annotated[str, matching(
    r"^[A-Za-z0-9:._/+=@,#&()-]([A-Za-z0-9:._/+=@,#&() -]{0,62}[A-Za-z0-9:._/+=@,#&()-])?$",
    "letters, digits, blanks within and : . _ / + = @ , # & ( ) - only, 64 at most, "
    "as `udevadm info -a` shows it", examples=["FTDI1234"],
), AfterValidator(_no_path)]  # fmt: skip
# As the kernel names a device of a USB port: the bus, then the ports of the hubs on the way.
UsbPort = Annotated[str, matching(
    r"^[0-9]{1,3}-[0-9]{1,3}(\.[0-9]{1,3}){0,6}$",
    "a USB port is a bus and the ports on the way, like 1-1.3, as `udevadm info -a` shows it as KERNELS",
    examples=["1-1.3"],
)]  # fmt: skip
# The kernel writes these ids in lower case, and udev compares letter by letter.
HexId = Annotated[str, matching(
    r"^[0-9a-fA-F]{4}$", "four hexadecimal digits, in quotes", examples=["0403"],
), AfterValidator(str.lower)]  # fmt: skip
GraphName = Annotated[str, matching(
    r"^[A-Za-z~/][A-Za-z0-9_/]*$", "a ROS name has letters, digits, _ and /, a letter first", max_length=200,
    description="A ROS graph name.", examples=["cmd_vel"],
)]  # fmt: skip
# Mavros has the system id of its vehicle in names.
DriverName = Annotated[str, matching(
    r"^([A-Za-z~/]|\{system_id\})([A-Za-z0-9_/]|\{system_id\})*$",
    "a ROS name has letters, digits, _ and /, a letter first, and may have {system_id}", max_length=200,
    description="A ROS graph name.", examples=["cmd_vel"],
)]  # fmt: skip
NAMESPACE = r"^[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)*$"
Namespace = Annotated[str, matching(
    NAMESPACE, "a namespace is names of letters, digits and _ with slashes between them, like k3/arm",
    max_length=200, examples=["k3/arm"],
)]  # fmt: skip
FrameName = Annotated[str, matching(
    r"^[A-Za-z{][A-Za-z0-9_/{}.-]*$",
    "a frame is letters, digits and _ / . -, a letter first, or has placeholders, like {frame}/odom",
    max_length=200, description="A frame of tf; it may have placeholders.", examples=["odom"],
)]  # fmt: skip
MESSAGE_TYPE = r"^[A-Za-z][A-Za-z0-9_]*/[A-Za-z][A-Za-z0-9_]*$"
TypeName = Annotated[str, matching(
    MESSAGE_TYPE, "write a message type as package/Type, like geometry_msgs/Twist",
    examples=["geometry_msgs/Twist"],
)]  # fmt: skip
# As catkin takes them.
PackageName = Annotated[str, matching(
    r"^[A-Za-z0-9][A-Za-z0-9_-]*$",
    "ROS packages are letters, digits, _ and hyphens, a letter or digit first", examples=["joy"],
)]  # fmt: skip
FileName = Annotated[str, matching(
    r"^[A-Za-z0-9_][A-Za-z0-9_.+-]*$",
    "the file's name alone, of letters, digits and _ . + -; roslaunch searches the folders of the "
    "package for it", examples=["joy_node"],
)]  # fmt: skip
LaunchFile = Annotated[str, matching(
    r"^[A-Za-z0-9_][A-Za-z0-9_.+-]*(/[A-Za-z0-9_][A-Za-z0-9_.+-]*)*$",
    "the path of the file within the package's folder `launch`, of letters, digits and _ . + -",
    max_length=255,
)]  # fmt: skip
#: A file by its path from the folder of the spec, or from that of a program's files.
FilePath = Annotated[str, matching(
    r"^[A-Za-z0-9_][A-Za-z0-9_.+-]*(?:/[A-Za-z0-9_][A-Za-z0-9_.+-]*)*$",
    "a path within that folder, of letters, digits and _ . + -, like config/slam.yaml", max_length=255,
    examples=["config/slam.yaml"],
)]  # fmt: skip
EnvironmentKey = Annotated[str, matching(
    r"^[A-Za-z_][A-Za-z0-9_]*$", "environment variables are letters, digits and _, no digit first",
)]  # fmt: skip
Printable = Annotated[str, matching(
    r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029\ufffe\uffff]*$", "text on one line, without control characters",
    max_length=4096,
)]  # fmt: skip


_PARAMETER_LIMITS = (
    "it has more than 100000 characters, or control characters beside line ends and tabs; "
    "let the program read the rest from a file"
)
_PARAMETER_KINDS = (
    "a parameter is text, a finite number, true or false, or a list or mapping of these; write one of them"
)
# The text of a parameter may be a whole file, such as a robot_description: lines and tabs are kept.
ParameterText = Annotated[str, matching(
    r"^[^\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\ufffe\uffff]*$",
    "text without control characters, line ends and tabs excepted", max_length=100_000,
)]  # fmt: skip


def _one_word(value: Any, inner: ValidatorFunctionWrapHandler) -> Any:
    """One complaint where a union would bring one for each of its members."""
    try:
        return inner(value)
    except ValidationError:
        if isinstance(value, str):
            raise ValueError(_PARAMETER_LIMITS) from None
        raise ValueError(_PARAMETER_KINDS) from None


Value = Annotated[bool | int | float | ParameterText, WrapValidator(_one_word)]


class _AnyParameter:
    """Metadata of a type: what a parameter server holds, as it is in the file."""

    examples = (0.5,)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> Any:
        return PlainValidator(_parameter).__get_pydantic_core_schema__(source, handler)

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        kinds = ("boolean", "integer", "number", "string", "array", "object")
        return {"anyOf": [{"type": kind} for kind in kinds]}


def _parameter(value: Any) -> Any:
    if isinstance(value, Mapping):
        for key, one in value.items():
            _parameter(key if isinstance(key, str) else None)
            _parameter(one)
        return value
    if isinstance(value, (tuple, list)):
        return tuple(_parameter(one) for one in value)
    return _SCALAR.validate_python(value, strict=True)


_SCALAR: TypeAdapter[Any] = TypeAdapter(Value, config=ConfigDict(allow_inf_nan=False))
#: A parameter: a Value, a list or a mapping of parameters.
Parameter = Annotated[Any, _AnyParameter()]

VARIABLE = r"^[a-z][a-z0-9_]{0,39}$"
VariableName = Annotated[str, matching(
    VARIABLE, "variables are lower-case letters, digits and _, a letter first, 40 at most",
    examples=["net"], description="Lower-case letters, digits and _, a letter first.",
)]  # fmt: skip
NO_VARS: dict[VariableName, Parameter] = {}  # one for all entries without
