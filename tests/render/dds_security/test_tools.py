"""The plugins of both DDS implementations take the files of an enclave of SROS 2, and refuse changed ones."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric.ec import (
    SECP256R1,
    EllipticCurvePrivateKey,
    generate_private_key,
)
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from cryptography.hazmat.primitives.serialization.pkcs7 import PKCS7Options, PKCS7SignatureBuilder

from tests.render.dds_security.build import IMPLEMENTATIONS
from tests.render.dds_security.participant import DOMAIN, NEEDED, UNSECURED, network, participant

pytestmark = NEEDED
NOW = datetime.now(timezone.utc)
BEGIN, END = NOW - timedelta(days=1), NOW + timedelta(days=365)  # Fast DDS takes them for local time
ODOMETRY, COMMAND = "rt/k3/odom", "rt/k3/cmd_vel"
Signer = tuple[x509.Certificate, EllipticCurvePrivateKey]

GOVERNANCE = f"""<?xml version="1.0" encoding="utf-8"?>
<dds><domain_access_rules><domain_rule>
  <domains><id>{DOMAIN}</id></domains>
  <allow_unauthenticated_participants>false</allow_unauthenticated_participants>
  <enable_join_access_control>true</enable_join_access_control>
  <discovery_protection_kind>ENCRYPT</discovery_protection_kind>
  <liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
  <rtps_protection_kind>SIGN</rtps_protection_kind>
  <topic_access_rules><topic_rule>
    <topic_expression>*</topic_expression>
    <enable_discovery_protection>true</enable_discovery_protection>
    <enable_liveliness_protection>true</enable_liveliness_protection>
    <enable_read_access_control>true</enable_read_access_control>
    <enable_write_access_control>true</enable_write_access_control>
    <metadata_protection_kind>ENCRYPT</metadata_protection_kind>
    <data_protection_kind>ENCRYPT</data_protection_kind>
  </topic_rule></topic_access_rules>
</domain_rule></domain_access_rules></dds>
"""
PERMISSIONS = f"""<?xml version="1.0" encoding="utf-8"?>
<dds><permissions><grant name="%(enclave)s">
  <subject_name>CN=%(enclave)s</subject_name>
  <validity><not_before>{BEGIN:%Y-%m-%dT%H:%M:%S}</not_before><not_after>{END:%Y-%m-%dT%H:%M:%S}</not_after></validity>
  <allow_rule>
    <domains><id>{DOMAIN}</id></domains>
    <publish><topics><topic>%(publishes)s</topic></topics></publish>
    <subscribe><topics><topic>%(subscribes)s</topic></topics></subscribe>
  </allow_rule>
  <default>DENY</default>
</grant></permissions></dds>
"""


def certificate(name: str, authority: Signer | None = None) -> Signer:
    key = generate_private_key(SECP256R1())
    subject = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, name)])
    made = (
        x509.CertificateBuilder(authority[0].subject if authority else subject, subject, key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(BEGIN)
        .not_valid_after(END)
        .add_extension(x509.BasicConstraints(ca=authority is None, path_length=None), critical=True)
    )
    return made.sign(authority[1] if authority else key, SHA256()), key


def signed(text: str, authority: Signer) -> bytes:
    builder = PKCS7SignatureBuilder().set_data(text.encode()).add_signer(*authority, SHA256())
    return builder.sign(Encoding.SMIME, [PKCS7Options.Text, PKCS7Options.DetachedSignature])


class Keystore:
    """The enclaves of a robot, which publishes its odometry, and of its leader, which commands it."""

    def __init__(self, folder: Path) -> None:
        self.authority = certificate("swarm")
        self.robot = self.enclave(folder / "robot", "/lab/k3", ODOMETRY, COMMAND)
        self.leader = self.enclave(folder / "leader", "/lab/leader", COMMAND, ODOMETRY)

    def enclave(self, folder: Path, name: str, publishes: str, subscribes: str) -> Path:
        folder.mkdir()
        own, key = certificate(name, self.authority)
        permissions = PERMISSIONS % {"enclave": name, "publishes": publishes, "subscribes": subscribes}
        (folder / "cert.pem").write_bytes(own.public_bytes(Encoding.PEM))
        (folder / "key.pem").write_bytes(key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()))
        for of in ("identity_ca", "permissions_ca"):
            (folder / f"{of}.cert.pem").write_bytes(self.authority[0].public_bytes(Encoding.PEM))
        (folder / "governance.p7s").write_bytes(signed(GOVERNANCE, self.authority))
        (folder / "permissions.p7s").write_bytes(signed(permissions, self.authority))
        return folder


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
        "permissions.p7s": (ODOMETRY, "rt/k4/odom"),
        "governance.p7s": ("<data_protection_kind>ENCRYPT", "<data_protection_kind>NONE"),
    }[name]
    changed = file.read_text().replace(before, after)
    assert changed != file.read_text()
    file.write_text(changed)
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
