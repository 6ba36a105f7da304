"""Fixtures: real servers on loopback, one for the tests that only need any, and the way to make others."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from swarmctl.remote.identities import Keyring
from swarmctl.remote.openssh import OpenSshTransport
from swarmctl.remote.ssh import SshTransport
from swarmctl.remote.ssh_limits import Timeouts
from tests.remote import sshd as servers
from tests.timing import PATIENCE

NOWHERE = Path("/nowhere")
AnySsh = SshTransport | OpenSshTransport
MakeTransport = Callable[..., AnySsh]


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


def with_paramiko(home: Path = NOWHERE, **options: Any) -> SshTransport:
    return SshTransport(Keyring(home, use_agent=False), **options)


def with_openssh(home: Path = NOWHERE, **options: Any) -> OpenSshTransport:
    return OpenSshTransport(home, use_agent=False, **options)


@pytest.fixture(params=[with_paramiko, with_openssh], ids=["paramiko", "openssh"])
def make(request: pytest.FixtureRequest) -> MakeTransport:
    """Makes a transport that trusts only the keys it is given: each in turn keeps the same promises."""
    if request.param is with_openssh and not shutil.which("ssh"):
        pytest.skip("needs ssh (apt install openssh-client)")
    return request.param  # type: ignore[no-any-return]


@pytest.fixture
def transport(make: MakeTransport) -> AnySsh:
    """A transport that is patient on a busy machine."""
    return make(timeouts=Timeouts(*[PATIENCE] * 4))


@pytest.fixture
def impatient(make: MakeTransport) -> AnySsh:
    """The same, for servers that do not answer in any time."""
    return make(timeouts=Timeouts(*[2.0] * 4))
