"""A stable identifier of a serial line is distinguished from one that only looks like it."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.linter.context import RuleContext
from swarmctl.linter.runner import lint
from swarmctl.render.build_bundle import bundles
from swarmctl.rules.identity import adapters_of_two_hosts, duplicate_devices
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import load_text
from tests.loading import load_swarm
from tests.timing import work_at_most

SPEC = """
version: 1
name: one
mode: leader
leader: laptop
hosts: {laptop: {address: 192.168.77.10, bluetooth: [hci0]}}
robots: {koala: {type: koala, host: laptop}}
links: [LINK]
"""
BY_ID = "/dev/serial/by-id/usb-FTDI_Quad_RS232-HS_FT4ABCDE"


def codes(link: str) -> list[str]:
    document, problems = load_text(SPEC.replace("LINK", link), "swarm.yaml", load_catalog())
    assert document is not None, problems
    return [one.code for one in lint(document)]


@pytest.mark.parametrize(
    ("serial", "code"),
    [
        ("A600dXyz", ""),
        ("FT4XQZ1O", ""),
        ("0001", "DEV004"),
        ("0", "DEV004"),
        ("00000000", "DEV004"),
        ("123456", "DEV004"),
        ("1234567", ""),
        ("FFFFFFFF", "DEV004"),
        ("0002", ""),
        ("01A2B3C4", ""),
        ("0000:00:14.0", "DEV003"),
        ("0000:01:00.0", "DEV003"),
        ("3f980000.usb", "DEV003"),
        ("musb-hdrc.1", "DEV003"),
        ("vhci_hcd.0", "DEV003"),
        ("10c4:ea60", "DEV003"),
        ("usb-FTDI_FT232R_USB_UART_A600dXyz-if00-port0", "DEV003"),
        ("usb-1", ""),
        ("00:15:83:3D", ""),
    ],
)
def test_serial_numbers_that_are_none(serial: str, code: str) -> None:
    link = f'{{kind: serial, host: laptop, robot: koala, usb: {{serial: "{serial}"}}}}'
    assert codes(link) == ([code] if code else [])


@pytest.mark.parametrize(
    ("usb", "code"),
    [
        ("{path: 1-1.3}", ""),
        ('{path: 1-1.3, vendor: 1a86, product: "7523"}', ""),
        ('{vendor: 1a86, product: "7523"}', "LINK004"),
        ('{serial: A1, vendor: 1a86, product: "7523"}', "DEV004"),
        ("{serial: A1, vendor: 1a86, product: 55d4}", ""),
        ('{serial: FT4ABCDE, vendor: "0403", product: "6011"}', "DEV004"),
        ('{path: 1-1.3, vendor: "0403", product: "6010"}', "DEV004"),
        ("{serial: FT4ABCDE, vendor: 10c4, product: ea70}", "DEV004"),
        ("{serial: FT4ABCDE, vendor: 10c4, product: ea71, interface: 3}", ""),
    ],
)
def test_adapters_without_a_serial_number_have_a_port(usb: str, code: str) -> None:
    assert codes(f"{{kind: serial, host: laptop, robot: koala, usb: {usb}}}") == ([code] if code else [])


def rendered(tmp_path: Path, usb: str) -> dict[str, str]:
    link = f"{{kind: serial, host: laptop, robot: koala, usb: {usb}}}"
    (tmp_path / "swarm.yaml").write_text(SPEC.replace("LINK", link))
    swarm, _ = load_swarm(tmp_path / "swarm.yaml")
    assert swarm is not None
    return {file.path: file.content.decode() for file in bundles(swarm)["laptop"].files}


@pytest.mark.parametrize(("usb", "device"), [
    ("{serial: FT4ABCDE, interface: 10}", 'ATTRS{serial}=="FT4ABCDE"'),
    ("{path: 1-1.3, interface: 10}", 'KERNELS=="1-1.3"'),
])  # fmt: skip
def test_the_udev_rule_of_an_adapter_with_several_ports_names_one(
    tmp_path: Path, usb: str, device: str
) -> None:
    """ATTRS of a rule are those of one parent (udev(7)); the number is as sysfs has it."""
    files = rendered(tmp_path, usb)
    by_interface = f'SUBSYSTEMS=="usb", {device}, ENV{{ID_USB_INTERFACE_NUM}}=="0a", SYMLINK+="swarm/koala"'
    assert by_interface in files["udev/60-swarm.rules"]
    assert "INTERFACE" not in files["udev/90-swarm.rules"]  # brltty takes the whole adapter


def test_the_udev_rule_of_a_port_names_no_serial_number(tmp_path: Path) -> None:
    files = rendered(tmp_path, '{path: 1-1.3, vendor: 1a86, product: "7523"}')
    by_port = (
        'SUBSYSTEMS=="usb", KERNELS=="1-1.3", ATTRS{idVendor}=="1a86", ATTRS{idProduct}=="7523", SYMLINK+='
    )
    assert by_port in files["udev/60-swarm.rules"]
    assert 'KERNEL=="1-1.3"' in files["udev/90-swarm.rules"]
    assert "serial}" not in files["udev/60-swarm.rules"]


@pytest.mark.parametrize(
    ("first", "second", "found"),
    [
        ("usb: {path: 1-1.3}", "usb: {path: 1-1.3}", ["ID002"]),
        ("usb: {path: 1-1.3, interface: 0}", "usb: {path: 1-1.3, interface: 1}", []),
        ("usb: {serial: FT4ABCDE, interface: 0}", "usb: {serial: FT4ABCDE, interface: 1}", []),
        ("usb: {serial: FT4ABCDE, interface: 1}", "usb: {serial: FT4ABCDE, interface: 1}", ["ID002"]),
        ("usb: {serial: FT4ABCDE}", "usb: {serial: FT4ABCDE, interface: 1}", ["ID002"]),
        ("usb: {serial: FT4ABCDE, interface: 1}", f"device: {BY_ID}-if01-port0", ["DEV001", "ID002"]),
        ("usb: {serial: FT4ABCDE, interface: 0}", f"device: {BY_ID}-if01-port0", ["DEV001"]),
    ],
)
def test_two_robots_in_one_port_are_an_error(first: str, second: str, found: list[str]) -> None:
    two = SPEC.replace("robots: {", "robots: {other: {type: koala, host: laptop}, ")
    ends = {"koala": first, "other": second}
    links = ", ".join(f"{{kind: serial, host: laptop, robot: {name}, {end}}}" for name, end in ends.items())
    document, problems = load_text(two.replace("LINK", links), "swarm.yaml", load_catalog())
    assert document is not None, problems
    assert [one.code for one in lint(document)] == found


@pytest.mark.parametrize(
    ("mac", "code"),
    [
        ("10:00:e8:c5:64:37", ""),
        ("00:00:00:00:00:00", "DEV005"),
        ("00:00:00:00:00:01", ""),
        ("FF:FF:FF:FF:FF:FF", "DEV005"),
        ("10:00:e8:9e:8b:00", "DEV005"),
        ("10:00:e8:9e:8b:3f", "DEV005"),
        ("10:00:e8:9e:8b:40", ""),
        ("02:00:e8:c5:64:37", ""),
    ],
)
def test_bluetooth_addresses_of_nobody(mac: str, code: str) -> None:
    link = f'{{kind: bluetooth, host: laptop, robot: koala, mac: "{mac}"}}'
    assert codes(link) == ([code] if code else [])


@pytest.mark.parametrize(
    ("device", "code"),
    [
        ("/dev/ttyS0", ""),
        ("/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0-port0", ""),
        ("/dev/serial/by-path/platform-3f980000.usb-usb-0-1.2", ""),
        ("/dev/serial/by-id/usb-FTDI_FT232R_A600dXyz-if00-port0", "DEV001"),
        ("/dev/ttyUSB0", "LINK005"),
        ("/dev/ttyACM3", "LINK005"),
        ("/dev/rfcomm0", "DEV002"),
    ],
)
def test_devices_that_do_not_last(device: str, code: str) -> None:
    link = f"{{kind: serial, host: laptop, robot: koala, device: {device}}}"
    document, problems = load_text(SPEC.replace("LINK", link), "swarm.yaml", load_catalog())
    found = lint(document) if document is not None else problems
    assert [one.code for one in found] == ([code] if code else [])


def test_adapters_of_one_serial_number_take_no_square_of_time() -> None:
    numbers = range(8000)
    robots = ", ".join(f"r{one}: {{type: koala, host: laptop}}" for one in numbers)
    links = ", ".join(
        f'{{kind: serial, host: laptop, robot: r{one}, usb: {{serial: A6, vendor: "{one:04x}"}}}}'
        for one in numbers
    )
    text = SPEC.replace("koala: {type: koala, host: laptop}", robots).replace("LINK", links)
    document, problems = load_text(text, "swarm.yaml", load_catalog())
    assert document is not None, problems
    context = RuleContext(document)
    with work_at_most(20):
        assert list(duplicate_devices(context)) == []
        assert list(adapters_of_two_hosts(context)) == []
