"""Fixtures: real servers on loopback, one for the tests that only need any, and the way to make others."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from swarmctl.remote.identities import Keyring
from swarmctl.remote.ssh import SshTransport, Timeouts
from tests.remote import sshd as servers
from tests.timing import PATIENCE


@pytest.fixture(scope="session")
def sshd(tmp_path_factory: pytest.TempPathFactory) -> Iterator[servers.Sshd]:
    """A server that nothing is done to."""
    if lacking := servers.missing():
        pytest.skip(f"needs {lacking}")
    with servers.running(tmp_path_factory.mktemp("sshd"), kinds=("rsa", "ecdsa", "ed25519")) as server:
        yield server


@pytest.fixture
def spare(tmp_path: Path) -> Path:
    """A folder for a server of the test's own."""
    if lacking := servers.missing():
        pytest.skip(f"needs {lacking}")
    return tmp_path / "sshd"


@pytest.fixture
def transport(tmp_path: Path) -> SshTransport:
    """A transport that trusts only the keys it is given."""
    return transport_of(tmp_path, PATIENCE)


@pytest.fixture
def impatient(tmp_path: Path) -> SshTransport:
    """The same, for servers that do not answer in any time."""
    return transport_of(tmp_path, 2)


def transport_of(folder: Path, seconds: float) -> SshTransport:
    timeouts = Timeouts(seconds, seconds, seconds, seconds)
    return SshTransport(Keyring(folder / "no-keys", use_agent=False), timeouts=timeouts)
