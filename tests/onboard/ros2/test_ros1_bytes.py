"""Messages of ROS 2 as bytes of ROS 1, and MD5 sums of their definitions, with packages made here."""

from __future__ import annotations

import struct
import sys
import types
from array import array
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from swarm_onboard.ros2 import board_types, ros1_bytes

DEFINITIONS = {
    "geometry_msgs/Vector3": "# a vector\nfloat64 x\nfloat64 y\nfloat64 z\n",
    "geometry_msgs/Twist": "Vector3  linear\nVector3  angular\n",
    "geometry_msgs/TwistStamped": "std_msgs/Header header\nTwist twist\n",
    "std_msgs/Int32": "int32 data\n",
    "sensor_msgs/CompressedImage": "std_msgs/Header header # stamp\nstring format\nuint8[] data\n",
    "diagnostic_msgs/KeyValue": "string key\nstring value\n",
    "diagnostic_msgs/DiagnosticStatus": "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\n"
    "string name\nstring message\nstring hardware_id\nKeyValue[] values\n",
    "sensor_msgs/NavSatStatus": "int8 STATUS_UNKNOWN = -2\nint8 STATUS_NO_FIX = -1\nint8 STATUS_FIX = 0\n"
    "int8 STATUS_SBAS_FIX = 1\nint8 STATUS_GBAS_FIX = 2\nint8 status -2 # default\n"
    "uint16 SERVICE_UNKNOWN = 0\nuint16 SERVICE_GPS = 1\nuint16 SERVICE_GLONASS = 2\n"
    "uint16 SERVICE_COMPASS = 4\nuint16 SERVICE_GALILEO = 8\nuint16 service\n",
    "sensor_msgs/NavSatFix": "std_msgs/Header header\nNavSatStatus status\nfloat64 latitude\n"
    "float64 longitude\nfloat64 altitude\nfloat64[9] position_covariance\nuint8 COVARIANCE_TYPE_UNKNOWN = 0\n"
    "uint8 COVARIANCE_TYPE_APPROXIMATED = 1\nuint8 COVARIANCE_TYPE_DIAGONAL_KNOWN = 2\n"
    "uint8 COVARIANCE_TYPE_KNOWN = 3\nuint8 position_covariance_type\n",
    "sensor_msgs/Range": "std_msgs/Header header\nuint8 ULTRASOUND=0\nuint8 INFRARED=1\n"
    "uint8 radiation_type\nfloat32 field_of_view\nfloat32 min_range\n"
    "float32 max_range\nfloat32 range\nfloat32 variance\n",
}
#: Of ROS 1, as `rosmsg md5` prints them.
SUMS = {
    "geometry_msgs/Twist": "9f195f881246fdfa2798d1d3eebca84a",
    "geometry_msgs/TwistStamped": "98d34b0043a2093cf9d9345ab6eef12e",
    "std_msgs/Int32": "da5909fbe378aeaf85e547e830cc1bb7",
    "sensor_msgs/CompressedImage": "8f7a12909da2c9d3332d540a0977563f",
    "sensor_msgs/NavSatFix": "2d3a8cd499b9b4a0249fb98fd05cfa48",
    "sensor_msgs/Range": "c005c34273dc426c67a020a87bc24148",
    "diagnostic_msgs/DiagnosticStatus": "d0ce08bc6e5ba34c7754f563a9cabaf1",
}
FIELDS: Mapping[str, Mapping[str, str]] = {
    "builtin_interfaces/Time": {"sec": "int32", "nanosec": "uint32"},
    "std_msgs/Header": {"stamp": "builtin_interfaces/Time", "frame_id": "string"},
    "geometry_msgs/Vector3": dict.fromkeys("xyz", "double"),
    "geometry_msgs/Twist": dict.fromkeys(("linear", "angular"), "geometry_msgs/Vector3"),
    "geometry_msgs/TwistStamped": {"header": "std_msgs/Header", "twist": "geometry_msgs/Twist"},
    "std_msgs/Int32": {"data": "int32"},
    "sensor_msgs/Range": {
        "header": "std_msgs/Header", "radiation_type": "uint8",
        **dict.fromkeys(("field_of_view", "min_range", "max_range", "range", "variance"), "float"),
    },
    "toy_msgs/Mixed": {
        "flags": "boolean[2]", "level": "octet", "words": "sequence<string>", "data": "sequence<uint8, 9>",
        "ranges": "sequence<float>", "few": "int16[3]",
        "way": "sequence<geometry_msgs/Vector3>",
    },
}  # fmt: skip
ZEROS: Mapping[str, Any] = {
    "string": "", "boolean[2]": [False, False], "octet": b"\x00", "double": 0.0, "int16[3]": [0, 0, 0]
}  # fmt: skip


def class_of(name: str, fields: Mapping[str, str]) -> type:
    """A class as rosidl makes one of a definition."""
    package, _, kind = name.partition("/")

    def init(self: Any, **given: Any) -> None:
        for field, text in fields.items():
            nested = sys.modules.get(f"{text.partition('/')[0]}.msg")
            zero = getattr(nested, text.rpartition("/")[2])() if nested and "sequence" not in text else None
            default = zero if zero is not None else ZEROS.get(text, [] if "sequence" in text else 0)
            setattr(self, field, given.get(field, default))

    members: dict[str, Any] = {
        "__init__": init,
        "__eq__": lambda self, other: vars(self) == vars(other),
        "__module__": f"{package}.msg._made",
        "get_fields_and_field_types": classmethod(lambda cls: dict(fields)),
    }
    return type(kind, (), members)


@pytest.fixture(autouse=True)
def host(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A host with these packages, as classes and as definitions."""
    for name, fields in FIELDS.items():
        package, _, kind = name.partition("/")
        module = sys.modules.get(f"{package}.msg") or types.ModuleType(f"{package}.msg")
        setattr(module, kind, class_of(name, fields))
        monkeypatch.setitem(sys.modules, package, types.ModuleType(package))
        monkeypatch.setitem(sys.modules, f"{package}.msg", module)
    for name, text in DEFINITIONS.items():
        package, _, kind = name.partition("/")
        file = tmp_path / "share" / package / "msg" / f"{kind}.msg"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"/nowhere:{tmp_path}")
    caches = (board_types.md5sum_and_least, ros1_bytes._message, ros1_bytes._codec)
    for cache in caches:
        cache.cache_clear()
    yield
    for cache in caches:
        cache.cache_clear()


@pytest.mark.parametrize(("name", "md5sum"), SUMS.items())
def test_a_definition_has_the_sum_of_ros_1(name: str, md5sum: str) -> None:
    assert board_types._md5sum(name) == md5sum


def test_a_type_has_the_size_of_its_smallest_message() -> None:
    assert board_types.md5sum_and_least("geometry_msgs/TwistStamped") == (
        SUMS["geometry_msgs/TwistStamped"],
        4 + 8 + 4 + 48,
    )


@pytest.mark.parametrize("name", ["std_msgs/Nothing", "nowhere/Twist", "Twist", "../std_msgs/Int32", ""])
def test_a_type_that_this_host_does_not_have_is_none(name: str) -> None:
    assert board_types.md5sum_and_least(name) is None


def test_a_header_has_a_sequence_number_in_ros_1() -> None:
    data = struct.pack("<III", 7, 12, 34) + struct.pack("<I", 4) + b"odom" + struct.pack("<6d", *range(6))
    message = ros1_bytes.decode("geometry_msgs/TwistStamped", data)
    assert (message.header.stamp.sec, message.header.frame_id, message.twist.angular.z) == (12, "odom", 5.0)
    assert ros1_bytes.encode(message) == bytes(4) + data[4:]


def test_lists_texts_and_bytes_survive_both_ways() -> None:
    module = sys.modules["toy_msgs.msg"]
    vector = sys.modules["geometry_msgs.msg"].Vector3
    message = module.Mixed(
        flags=[True, False], level=b"\x02", words=["a", "äö"], data=array("B", [1, 255]),
        ranges=array("f", [0.5, 2.0]), few=[-1, 0, 1], way=[vector(x=1.5), vector()],
    )  # fmt: skip
    data = ros1_bytes.encode(message)
    assert data[:3] == b"\x01\x00\x02"
    assert ros1_bytes.decode("toy_msgs/Mixed", data) == message


def test_a_field_that_ros_1_lacks_stays_behind() -> None:
    seen = sys.modules["sensor_msgs.msg"].Range(range=1.5, variance=0.25)
    data = ros1_bytes.encode(seen)
    assert len(data) == 4 + 8 + 4 + 1 + 4 * 4
    arrived = ros1_bytes.decode("sensor_msgs/Range", data)
    assert (arrived.range, arrived.variance) == (1.5, 0)


def test_a_definition_that_ros_1_does_not_have_is_no_other_one(tmp_path: Path) -> None:
    """A field that a future distro adds changes the bytes: nothing is taken for what it was."""
    file = tmp_path / "share/sensor_msgs/msg/Range.msg"
    file.write_text(file.read_text() + "float32 humidity\n")
    assert board_types._md5sum("sensor_msgs/Range") != SUMS["sensor_msgs/Range"]


@pytest.mark.parametrize("length", [5, 1 << 31])
def test_a_list_that_is_cut_short_is_an_error(length: int) -> None:
    data = bytes(3) + struct.pack("<II", 0, length) + bytes(4)
    with pytest.raises(ValueError, match="cut short"):
        ros1_bytes.decode("toy_msgs/Mixed", data)


@pytest.mark.parametrize("data", [b"", bytes(47), bytes(49)])
def test_bytes_that_are_no_such_message_are_an_error(data: bytes) -> None:
    with pytest.raises(ValueError, match="bytes are no geometry_msgs/Twist"):
        ros1_bytes.decode("geometry_msgs/Twist", data)
