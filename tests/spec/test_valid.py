"""What may be written: the examples, and what YAML 1.1 would have misread."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.diagnostics import has_errors
from swarmctl.links.bluetooth_link import RfcommLine
from swarmctl.links.serial_link import UsbLine
from swarmctl.linter.runner import lint
from swarmctl.rulebook import Severity
from swarmctl.spec.catalog import Catalog, load_catalog
from swarmctl.spec.load import load_text
from tests import ROOT
from tests.loading import load_swarm

EXAMPLES = sorted((ROOT / "examples").glob("*/swarm.yaml"))


@pytest.fixture(scope="module")
def catalog() -> Catalog:
    return load_catalog()


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.parent.name)
def test_examples_are_free_of_findings(example: Path) -> None:
    swarm, found = load_swarm(example)
    assert found == ()
    assert swarm is not None


def test_there_are_examples() -> None:
    assert EXAMPLES


def test_the_catalog_is_free_of_findings(catalog: Catalog) -> None:
    assert catalog.diagnostics == ()
    assert {"koala", "khepera3", "epuck"} <= set(catalog.types)


def test_a_bluetooth_address_of_digits_needs_no_quotes(leader_spec: Path, tmp_path: Path) -> None:
    text = leader_spec.read_text("utf-8").replace('"10:00:e8:c5:64:37"', "10:00:52:14:33:11")
    (tmp_path / "swarm.yaml").write_text(text, "utf-8")
    swarm, found = load_swarm(tmp_path / "swarm.yaml")
    assert found == ()
    assert swarm is not None
    line = swarm.robots["epuck"].line
    assert isinstance(line, RfcommLine)
    assert line.mac == "10:00:52:14:33:11"


@pytest.mark.parametrize(("number", "codes"), [("A600dXyz", ["ID007"]), ("'0001'", ["DEV004", "DEV004"])])
def test_one_serial_number_on_two_hosts_is_a_warning(
    number: str, codes: list[str], leader_spec: Path, catalog: Catalog
) -> None:
    text = leader_spec.read_text("utf-8").replace("FTDI1234", number).replace("A600dXyz", number)
    document, _ = load_text(text, "swarm.yaml", catalog)
    assert document is not None
    assert [one.code for one in lint(document)] == codes


def test_two_models_of_adapter_may_share_a_serial_number(leader_spec: Path, catalog: Catalog) -> None:
    text = leader_spec.read_text("utf-8").replace("FTDI1234", 'A600dXyz, vendor: "0403"')
    text = text.replace("{serial: A600dXyz}", "{serial: A600dXyz, vendor: 10c4}")
    document, _ = load_text(text, "swarm.yaml", catalog)
    assert document is not None
    assert lint(document) == ()


@pytest.mark.parametrize(
    ("device", "codes"),
    [
        ("usb-Prolific_Technology_Inc._USB-Serial_Controller-if00-port0", ["DEV001", "DEV001"]),
        ("usb-1a86_USB2.0-Serial-if00-port0", ["DEV001", "DEV001"]),
        ("usb-FTDI_FT232R_USB_UART_A600dXyz-if00-port0", ["DEV001", "DEV001", "ID007"]),
    ],
)
def test_adapters_without_serial_number_are_not_one(
    device: str, codes: list[str], leader_spec: Path, catalog: Catalog
) -> None:
    text = leader_spec.read_text("utf-8")
    for old in ("usb: {serial: FTDI1234}", "usb: {serial: A600dXyz}"):
        text = text.replace(old, f"device: /dev/serial/by-id/{device}")
    document, _ = load_text(text, "swarm.yaml", catalog)
    assert document is not None
    assert sorted(one.code for one in lint(document)) == codes


def test_replacing_a_type_of_the_catalog_is_a_warning(leader_spec: Path, tmp_path: Path) -> None:
    (tmp_path / "robots").mkdir()
    shipped = (ROOT / "templates/robots/koala.yaml").read_text("utf-8")
    (tmp_path / "robots/koala.yaml").write_text(shipped, "utf-8")
    (tmp_path / "swarm.yaml").write_text(leader_spec.read_text("utf-8"), "utf-8")
    swarm, (found,) = load_swarm(tmp_path / "swarm.yaml")
    assert swarm is not None
    assert found.code == "REF004"
    assert "robots/koala.yaml" in found.message
    assert "the catalog of swarmctl" in found.message


def test_adapters_with_one_serial_number_differ_by_their_ids(leader_spec: Path, catalog: Catalog) -> None:
    text = (
        leader_spec.read_text("utf-8")
        .replace("type: khepera3, host: k3-pi", "type: khepera3, host: koala-laptop")
        .replace(
            "host: k3-pi, robot: k3, usb: {serial: FTDI1234}",
            'host: koala-laptop, robot: k3, usb: {serial: "1", vendor: "0403"}',
        )
        .replace("usb: {serial: A600dXyz}", 'usb: {serial: "1", vendor: 10C4}')
    )
    document, _ = load_text(text, "swarm.yaml", catalog)
    assert document is not None
    assert lint(document) == ()


def test_usb_ids_become_lower_case_as_the_kernel_writes_them(leader_spec: Path, tmp_path: Path) -> None:
    text = leader_spec.read_text("utf-8").replace(
        "{serial: FTDI1234}", "{serial: FTDI1234, vendor: 10C4, product: EA60}"
    )
    (tmp_path / "swarm.yaml").write_text(text, "utf-8")
    swarm, _ = load_swarm(tmp_path / "swarm.yaml")
    assert swarm is not None
    line = swarm.robots["k3"].line
    assert isinstance(line, UsbLine)
    assert (line.usb.vendor, line.usb.product) == ("10c4", "ea60")


def test_a_robot_type_beside_the_spec_is_found(leader_spec: Path, root: Path, tmp_path: Path) -> None:
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots/tracked.yaml").write_bytes((root / "templates/robots/koala.yaml").read_bytes())
    text = leader_spec.read_text("utf-8").replace("{type: koala,", "{type: tracked,")
    (tmp_path / "swarm.yaml").write_text(text, "utf-8")
    swarm, found = load_swarm(tmp_path / "swarm.yaml")
    assert found == ()
    assert swarm is not None
    assert swarm.robots["koala"].type_name == "tracked"


def test_a_broken_robot_type_beside_the_spec_is_shown_in_its_own_file(
    leader_spec: Path, tmp_path: Path
) -> None:
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots/tracked.yaml").write_text("titel: Tracked\n", "utf-8")
    (tmp_path / "swarm.yaml").write_bytes(leader_spec.read_bytes())
    swarm, found = load_swarm(tmp_path / "swarm.yaml")
    assert swarm is None
    assert {one.span.file for one in found if one.span} == {str(tmp_path / "robots/tracked.yaml")}
    assert "unknown key `titel`" in {one.message for one in found}


@pytest.mark.parametrize("mode", ["single-minded", "leader", "central"])
def test_the_ready_modes(mode: str, leader_spec: Path, catalog: Catalog) -> None:
    text = leader_spec.read_text("utf-8").replace("mode: leader", f"mode: {mode}")
    if mode == "central":
        text = text.replace("leader: koala", "hub: koala")
    if mode == "single-minded":
        text = text.replace(", computer: laptop", ", computer: laptop, bluetooth: [hci0]")
        for host in ("k3-pi", "epuck-pi"):
            text = text.replace(f", host: {host}}}", "}").replace(
                f"host: {host}, robot", "host: koala-laptop, robot"
            )
    document, found = load_text(text, "swarm.yaml", catalog)
    assert found == ()
    assert document is not None
    assert lint(document) == ()


@pytest.mark.parametrize(
    ("limits", "warned"),
    [("{linear: 0.1}", []), ("{linear: 3.0}", ["SET001"]), ("{angular: 50.0}", ["SET001"])],
)
def test_a_limit_above_what_the_robot_can_do_brings_a_warning(
    limits: str, warned: list[str], leader_spec: Path, catalog: Catalog
) -> None:
    text = leader_spec.read_text("utf-8").replace(
        "{type: epuck, host: epuck-pi}", f"{{type: epuck, host: epuck-pi, settings: {{limits: {limits}}}}}"
    )
    document, _ = load_text(text, "swarm.yaml", catalog)
    assert document is not None
    assert [one.code for one in lint(document) if one.severity is Severity.WARNING] == warned
    assert not has_errors(lint(document))


def test_a_swarm_of_one_host_may_call_it_by_its_own_address(catalog: Catalog) -> None:
    text = """
version: 1
name: alone
mode: leader
leader: laptop
hosts: {laptop: {address: 127.0.0.1}}
robots: {koala: {type: koala, host: laptop}}
links: [{kind: serial, host: laptop, robot: koala, device: /dev/ttyS0}]
"""
    document, _ = load_text(text, "swarm.yaml", catalog)
    assert document is not None
    assert lint(document) == ()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("user: robot", "user: jane.doe"),
        ("user: robot", "user: LabRobot_2"),
        ("{serial: FTDI1234}", '{serial: "USB Serial+/=@(1)"}'),
        ("usb: {serial: FTDI1234}", 'device: "/dev/serial/by-path/pci-0000:00:14.0-usb-0:1..2:1.0-port0"'),
    ],
)
def test_what_linux_allows_is_taken(old: str, new: str, leader_spec: Path, catalog: Catalog) -> None:
    document, found = load_text(leader_spec.read_text("utf-8").replace(old, new), "swarm.yaml", catalog)
    assert document is not None, found
    assert lint(document) == ()


@pytest.mark.parametrize(
    "program",
    [
        "{host: koala-laptop, package: nav, launch: includes/kinect.launch.xml}",
        '{host: koala-laptop, package: nav, executable: pub, params: {urdf: "<robot>\\n\\t<a/>\\n</robot>"}}',
        '{host: koala-laptop, package: nav, launch: a.launch, params: {text: "a: 1\\nb: 2\\n"}}',
    ],
)
def test_what_ros_allows_is_taken(program: str, leader_spec: Path, catalog: Catalog) -> None:
    text = leader_spec.read_text("utf-8") + f"\nprograms:\n  one: {program}\n"
    document, found = load_text(text, "swarm.yaml", catalog)
    assert document is not None, found
    assert lint(document) == ()
