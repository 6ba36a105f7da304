"""Fixtures: real servers on loopback, one for the tests that only need any, and the way to make others."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
import sshd as servers

from swarmctl.remote.identities import Keyring
from swarmctl.remote.ssh import SshTransport, Timeouts


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
    """A transport that knows no keys but those it is given."""
    return SshTransport(Keyring(tmp_path / "no-keys", use_agent=False), timeouts=Timeouts(2, 2, 5, 5))
