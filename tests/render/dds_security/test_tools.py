"""The plugins of both DDS implementations take the files of an enclave of SROS 2, and refuse changed ones."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from swarmctl.deploy.sros2_keystore import missing
from swarmctl.render.bundle import Enclave
from swarmctl.render.ros2.enclaves import governance
from swarmctl.spec import keystore as layout
from tests.render.dds_security.build import IMPLEMENTATIONS
from tests.render.dds_security.participant import DOMAIN, NEEDED, UNSECURED, network, participant

pytestmark = NEEDED
ODOMETRY, COMMAND = "rt/k3/odom", "rt/k3/cmd_vel"
PERMISSIONS = f"""<?xml version="1.0" encoding="utf-8"?>
<dds><permissions><grant name="%(name)s">
  <subject_name>CN=/%(name)s</subject_name>
  <validity><not_before>2000-01-01T00:00:00</not_before><not_after>2099-12-31T00:00:00</not_after></validity>
  <allow_rule>
    <domains><id>{DOMAIN}</id></domains>
    <publish><topics><topic>%(publishes)s</topic></topics></publish>
    <subscribe><topics><topic>%(subscribes)s</topic></topics></subscribe>
  </allow_rule>
  <default>DENY</default>
</grant></permissions></dds>
"""


class Keystore:
    """The enclaves of a robot, which publishes its odometry, and of its leader, which commands it."""

    def __init__(self, folder: Path) -> None:
        robot, leader = enclave("k3", ODOMETRY, COMMAND), enclave("leader", COMMAND, ODOMETRY)
        made = missing([robot, leader], {}, {})

        def put(one: Enclave) -> Path:
            own = folder / one.name
            own.mkdir()
            for name in (layout.CERTIFICATE, layout.PERMISSIONS):
                (own / name).write_bytes(made.files[f"{one.folder}/{name}"])
            for of in ("identity_ca", "permissions_ca"):
                (own / f"{of}.cert.pem").write_bytes(made.files[layout.CA])
            (own / "governance.p7s").write_bytes(made.files[layout.GOVERNANCE])
            (own / "key.pem").write_text(made.secrets[one.key])
            return own

        self.robot, self.leader = put(robot), put(leader)


def enclave(name: str, publishes: str, subscribes: str) -> Enclave:
    """The enclave with permissions of its own, which a swarm's would not give."""
    permissions = PERMISSIONS % {"name": name, "publishes": publishes, "subscribes": subscribes}
    folder, key = layout.folder("lab", name), layout.secret(name)
    return Enclave(name, f"/{name}", folder, key, governance(), permissions.encode(), complete=False)


@pytest.fixture(scope="module")
def namespace() -> Iterator[str]:
    with network() as name:
        yield name


@pytest.fixture
def keystore(tmp_path: Path) -> Keystore:
    return Keystore(tmp_path)


@pytest.fixture(params=IMPLEMENTATIONS)
def start(request: pytest.FixtureRequest, namespace: str, tmp_path: Path) -> Any:
    """Starts a participant of each implementation: the folder of its enclave, and its endpoints."""
    return lambda *words: participant(request.param, namespace, tmp_path, *words)


def test_an_enclave_creates_what_its_permissions_allow(start: Any, keystore: Keystore) -> None:
    topics = (ODOMETRY, COMMAND, "rt/k3/odom2", "rt/other")
    endpoints = [f"{kind} {topic}" for kind in ("pub", "sub") for topic in topics]
    with start(keystore.robot, *endpoints) as robot:
        created = robot.created()
    assert {one for one, made in created.items() if made} == {("pub", ODOMETRY), ("sub", COMMAND)}
    assert len(created) == len(endpoints)


@pytest.mark.parametrize("name", ["permissions.p7s", "governance.p7s"])
def test_a_file_changed_after_its_signature_is_refused(name: str, start: Any, keystore: Keystore) -> None:
    file = keystore.robot / name
    before, after = {
        "permissions.p7s": (ODOMETRY.encode(), b"rt/k4/odom"),
        "governance.p7s": (b"<data_protection_kind>ENCRYPT", b"<data_protection_kind>NONE"),
    }[name]
    changed = file.read_bytes().replace(before, after)
    assert changed != file.read_bytes()
    file.write_bytes(changed)
    with start(keystore.robot) as robot:
        assert not robot.accepted()


@pytest.mark.parametrize("name", ["cert.pem key.pem", "permissions.p7s", "governance.p7s"])
def test_what_another_authority_signed_is_refused(
    name: str, start: Any, keystore: Keystore, tmp_path: Path
) -> None:
    (tmp_path / "foreign").mkdir()
    foreign = Keystore(tmp_path / "foreign")
    for file in name.split():
        (keystore.robot / file).write_bytes((foreign.robot / file).read_bytes())
    with start(keystore.robot) as robot:
        assert not robot.accepted()


def test_permissions_of_another_enclave_are_refused(start: Any, keystore: Keystore) -> None:
    (keystore.robot / "permissions.p7s").write_bytes((keystore.leader / "permissions.p7s").read_bytes())
    with start(keystore.robot) as robot:
        assert not robot.accepted()


def test_two_enclaves_exchange_samples(start: Any, keystore: Keystore) -> None:
    with (
        start(keystore.robot, f"pub {ODOMETRY}", f"sub {COMMAND}") as robot,
        start(keystore.leader, f"pub {COMMAND}", f"sub {ODOMETRY}") as leader,
    ):
        robot.receives(COMMAND)
        leader.receives(ODOMETRY)


def test_who_has_no_keys_reads_and_commands_nothing(start: Any, keystore: Keystore) -> None:
    with (
        start(UNSECURED, f"pub {COMMAND}", f"sub {ODOMETRY}", "sub rt/chat") as stranger,
        start(keystore.robot, f"pub {ODOMETRY}", f"sub {COMMAND}") as robot,
    ):
        assert all(robot.created().values())
        with (
            start(keystore.leader, f"sub {ODOMETRY}") as leader,
            start(UNSECURED, f"sub {COMMAND}", "pub rt/chat") as other,
        ):  # who came later found both
            leader.receives(ODOMETRY)
            other.receives(COMMAND)
            stranger.receives("rt/chat")
        assert stranger.received() == {"rt/chat"}
        assert robot.received() == set()
