"""Values that stand until somebody fills them in, and bags that a restart overwrites."""

from __future__ import annotations

import pytest

from swarmctl.linter.runner import lint
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import load_text

LINES = """
version: 1
name: hall
mode: single-minded
leader: laptop
hosts:
  laptop: {address: 192.168.77.10, user: robot, computer: laptop, bluetooth: [hci0]}
robots:
  "k[1-8]": {type: khepera3}
  "epuck-[1-2]": {type: epuck}
links:
  - {kind: serial, host: laptop, robot: "k[1-8]", usb: {serial: "SERIAL"}}
  - {kind: bluetooth, host: laptop, robot: "epuck-[1-2]", mac: "MAC"}
programs:
  record: {host: laptop, PROGRAM}
"""


def messages(code: str, serial: str, mac: str, program: str) -> list[str]:
    text = LINES.replace("SERIAL", serial).replace("MAC", mac).replace("PROGRAM", program)
    document, found = load_text(text, "swarm.yaml", load_catalog())
    assert document is not None, found
    return [one.message for one in lint(document) if one.code == code]


@pytest.mark.parametrize(
    ("serial", "mac", "expected"),
    [
        (
            "SERIAL-OF-K-[1-8]",
            "02:00:00:00:00:[09-10]",
            [
                "the USB serial numbers of `k1`, `k2`, `k3`, `k4`, `k5`, `k6` and 2 more are placeholders",
                "the Bluetooth addresses of `epuck-1`, `epuck-2` are placeholders",
            ],
        ),
        ("FTDI[1-8]", "10:00:E8:C5:64:[09-10]", []),
    ],
)
def test_placeholders_are_one_finding_per_kind(serial: str, mac: str, expected: list[str]) -> None:
    assert messages("LINK013", serial, mac, "command: [date]") == expected


@pytest.mark.parametrize(
    ("program", "warned"),
    [
        ("command: [rosbag, record, -a, -O, a.bag]", True),
        ("command: [/opt/ros/noetic/bin/rosbag, record, --output-name=a.bag, /k3_1/odom]", True),
        ("package: rosbag, executable: record, args: [-O, a.bag, -a]", True),
        ("command: [rosbag, record, -a, -o, a]", False),
        ("command: [rosbag, record, -a, -O, a.bag], lifecycle: interactive", False),
        ("command: [rosbag, filter, -O, a.bag]", False),
    ],
)
def test_a_service_with_a_fixed_bag_is_a_warning(program: str, warned: bool) -> None:
    found = messages("PROG033", "FTDI[1-8]", "10:00:E8:C5:64:[09-10]", program)
    assert found == (["each restart of program `record` overwrites its bag"] if warned else [])
