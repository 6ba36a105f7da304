"""What a host knows of its kernel, hardware, packages and its robots' firmwares, below another root."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
from swarm_onboard.agent.hardware import UsbDevice
from swarm_onboard.agent.rpc import Report
from swarm_onboard.agent.verbs import system

from tests.onboard.agent.test_stop import SWARM, running

BUS = "sys/devices/pci0000:00/usb1"
HUB, ADAPTER, LIDAR = f"{BUS}/1-1", f"{BUS}/1-1/1-1.10", f"{BUS}/1-1/1-1.1"
ATTRIBUTES: dict[str, dict[str, Any]] = {
    HUB: {"idVendor": "05e3", "idProduct": "0608", "bDeviceClass": "09"},
    ADAPTER: {
        "idVendor": "0403", "idProduct": "6001", "bDeviceClass": "00",
        "manufacturer": "FTDI", "product": "FT232R USB UART", "serial": "A1004xyz",
    },
    LIDAR: {"idVendor": "10c4", "idProduct": "ea60", "bDeviceClass": "00", "product": "x" * 5000},
}  # fmt: skip


@pytest.fixture(autouse=True)
def host(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SWARM_PREFIX", str(tmp_path))
    return tmp_path


def write(host: Path, path: str, text: str) -> None:
    (host / path).parent.mkdir(parents=True, exist_ok=True)
    (host / path).write_text(text)


def plug_in(host: Path) -> None:
    """A hub with a serial adapter and a lidar, as sysfs has them, and what udev makes of the adapter."""
    for folder, attributes in ATTRIBUTES.items():
        for name, value in attributes.items():
            write(host, f"{folder}/{name}", f"{value}\n")
    port = f"{ADAPTER}/1-1.10:1.0/ttyUSB0/tty/ttyUSB0"
    (host / port).mkdir(parents=True)
    for folder in ("sys/bus/usb/devices", "sys/class/tty"):
        (host / folder).mkdir(parents=True)
    for one in (HUB, ADAPTER, LIDAR):
        (host / "sys/bus/usb/devices" / Path(one).name).symlink_to(
            os.path.relpath(one, "sys/bus/usb/devices")
        )
    (host / "sys/bus/usb/devices/1-1.10:1.0").symlink_to(
        os.path.relpath(f"{ADAPTER}/1-1.10:1.0", "sys/bus/usb/devices")
    )
    (host / "sys/class/tty/ttyUSB0").symlink_to(os.path.relpath(port, "sys/class/tty"))
    write(host, "dev/ttyUSB0", "")
    (host / "dev/koala").symlink_to("ttyUSB0")


def found_for(*requires: str, **robots: str) -> system.Answer:
    return system.handle(system.Request(SWARM, requires, robots), b"", Report("n"))


def test_the_usb_devices_of_a_host_and_the_port_of_its_robot(host: Path) -> None:
    plug_in(host)
    found = found_for(koala="/dev/koala", k3="/dev/k3", cart="")
    assert [one._replace(name=one.name[:20]) for one in found.devices] == [
        UsbDevice("10c4", "ea60", "x" * 20, "", []),
        UsbDevice("0403", "6001", "FTDI FT232R USB UART", "A1004xyz", ["/dev/ttyUSB0"]),
    ]
    assert len(found.devices[0].name) == 200
    assert found.ports == {"koala": "/dev/ttyUSB0"}
    assert found.kernel.startswith(f"{os.uname().release} ")


@pytest.mark.parametrize(
    ("files", "model"),
    [
        ({"proc/device-tree/model": "Raspberry Pi 4 Model B Rev 1.4\0"}, "Raspberry Pi 4 Model B Rev 1.4"),
        (
            {"sys/class/dmi/id/sys_vendor": "LENOVO\n", "sys/class/dmi/id/product_name": "20XW\n"},
            "LENOVO 20XW",
        ),
        ({"sys/class/dmi/id/product_name": "Standard PC\n"}, "Standard PC"),
        ({}, ""),
    ],
)
def test_the_model_of_a_board_or_computer(host: Path, files: dict[str, str], model: str) -> None:
    for path, text in files.items():
        write(host, path, text)
    assert found_for().model == model


def test_packages_that_are_there_have_their_versions(host: Path) -> None:
    write(host, "opt/ros/noetic/share/joy/package.xml", "<package><version>1.15.1</version></package>")
    write(host, "usr/share/odd/package.xml", "<package><version>new</version></package>")
    assert found_for("rospy", "package:joy", "package:odd", "package:absent").packages == {"joy": "1.15.1"}


def test_only_a_firmware_that_a_robot_has_sent_is_there(host: Path) -> None:
    with running(host, "koala", firmware="5,1"), running(host, "k3", firmware=""), running(host, "cart"):
        assert found_for(koala="", k3="", cart="", epuck="").firmware == {"koala": "5,1"}
        assert found_for(k3="").firmware == {}
