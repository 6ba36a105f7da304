"""The leader's swarm of ROS 2 with SROS 2, in a folder of its own, and what it needs signed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle, Enclave
from swarmctl.spec import keystore
from swarmctl.swarm.resolved import Swarm
from tests import ROOT
from tests.loading import load_swarm

_SECOND_LINE = "  - {kind: serial, host: k3-pi, robot: second, usb: {serial: FTDI5}}\n"
#: The robot `second` joins.
JOINS = {
    "  epuck: {": "  second: {type: khepera3, host: k3-pi}\n  epuck: {",
    "  - {kind: bluetooth": f"{_SECOND_LINE}  - {{kind: bluetooth",
    "of: [koala, k3, epuck]": "of: [koala, k3, epuck, second]",
}


def write_spec(
    folder: Path, changes: Mapping[str, str] | None = None, ros: str = "distro: jazzy, sros2: true"
) -> Path:
    """Writes the spec, in which each key of ``changes`` is replaced by its value; returns its path."""
    text = (ROOT / "examples/ros2-2-leader/swarm.yaml").read_text("utf-8")
    for old, new in {"{distro: jazzy}": f"{{{ros}}}", **(changes or {})}.items():
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    spec = folder / "swarm.yaml"
    spec.write_text(text, "utf-8")
    return spec


def swarm_in(folder: Path) -> Swarm:
    """The swarm of the spec in a folder, with the keystore beside it."""
    swarm, found = load_swarm(folder / "swarm.yaml")
    assert swarm is not None, found
    return swarm


def enclaves_of(wanted: Mapping[str, Bundle]) -> dict[str, Enclave]:
    """The enclaves of all hosts, by name."""
    return {one.name: one for bundle in wanted.values() for one in bundle.enclaves}


def bundles_in(folder: Path) -> Mapping[str, Bundle]:
    """What the hosts of the spec in a folder get."""
    return bundles(swarm_in(folder))


def write_fake_keystore(folder: Path) -> None:
    """Writes what the keystore of the spec in ``folder`` has, always the same, without signatures."""
    files = {keystore.CA: b"the authority\n"}
    for one in enclaves_of(bundles_in(folder)).values():
        files[f"{one.folder}/{keystore.CERTIFICATE}"] = f"the certificate of {one.subject}\n".encode()
        files[keystore.GOVERNANCE] = keystore.in_signed(one.governance)
        files[f"{one.folder}/{keystore.PERMISSIONS}"] = keystore.in_signed(one.permissions)
    for path, content in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(content)
