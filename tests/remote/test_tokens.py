"""Keys in a PKCS#11 token: a real ssh, its agent and SoftHSM, as with a smart card or a YubiKey."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from swarmctl.remote.openssh import OpenSshTransport
from swarmctl.remote.transport import HostError, Kind
from tests.remote import sshd as servers
from tests.remote.sshd import Sshd

LIBRARY = Path("/usr/lib/softhsm/libsofthsm2.so")
TOOLS = ("ssh", "ssh-agent", "ssh-add", "softhsm2-util", "pkcs11-tool")
PIN = "4711"


@dataclass(frozen=True)
class Token:
    """A token with one key, whose ``public`` half this is; ``home``, the folder ``.ssh``, names it."""

    home: Path
    public: str


@pytest.fixture
def token(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Token:
    lacking = [one for one in TOOLS if not shutil.which(one)] + [str(LIBRARY)] * (not LIBRARY.exists())
    if lacking:
        pytest.skip(f"needs {', '.join(lacking)} (apt install softhsm2 opensc)")
    for name in ("tokens", "ssh"):
        (tmp_path / name).mkdir()
    (tmp_path / "softhsm2.conf").write_text(f"directories.tokendir = {tmp_path}/tokens\nlog.level = ERROR\n")
    monkeypatch.setenv("SOFTHSM2_CONF", str(tmp_path / "softhsm2.conf"))
    login = ("--pin", PIN)
    run("softhsm2-util", "--init-token", "--free", "--label", "lab", "--so-pin", "0815", *login)
    key = ("--keypairgen", "--key-type", "EC:prime256v1", "--label", "ann", "--id", "01")
    run("pkcs11-tool", "--module", str(LIBRARY), "--token-label", "lab", "--login", *login, *key)
    (tmp_path / "ssh/config").write_text(f"PKCS11Provider {LIBRARY}\n")
    return Token(tmp_path / "ssh", run("ssh-keygen", "-D", str(LIBRARY)).strip())


def run(*command: str, **environment: str) -> str:
    done = subprocess.run(
        command, check=False, capture_output=True, text=True, env={**os.environ, **environment},
        stdin=subprocess.DEVNULL,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture
def agent(token: Token, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The operator's agent."""
    place = tmp_path / "agent"
    with subprocess.Popen(["ssh-agent", "-D", "-a", str(place)], stdout=subprocess.DEVNULL) as process:
        monkeypatch.setenv("SSH_AUTH_SOCK", str(place))
        while not place.exists():
            assert process.poll() is None
        yield place
        process.send_signal(signal.SIGTERM)


def add_to_agent(folder: Path) -> None:
    asks = folder / "askpass"
    asks.write_text(f"#!/bin/sh\necho {PIN}\n")
    asks.chmod(0o700)
    run("ssh-add", "-s", str(LIBRARY), SSH_ASKPASS=str(asks), SSH_ASKPASS_REQUIRE="force")


@pytest.fixture
def server(token: Token, spare: Path) -> Iterator[Sshd]:
    """A host that only the token's key logs in to."""
    with servers.running(spare, authorize=False) as running:
        (running.folder / "authorized").write_text(f"{token.public}\n")
        yield running


@pytest.mark.usefixtures("agent")
def test_a_key_in_a_token_logs_in_through_the_agent(token: Token, server: Sshd, tmp_path: Path) -> None:
    add_to_agent(tmp_path)
    with OpenSshTransport(token.home).connect(server.target(identities=())) as session:
        assert servers.run(session, "echo in").stdout == b"in\n"


def test_a_pin_that_nobody_can_type_is_an_error_with_the_way_out(token: Token, server: Sshd) -> None:
    transport = OpenSshTransport(token.home, use_agent=False)
    with pytest.raises(HostError) as caught, transport.connect(server.target(identities=())):
        pass
    assert caught.value.kind is Kind.AUTH
    assert caught.value.message == f"the token of {LIBRARY} wants its PIN"
    assert f"ssh-add -s {LIBRARY}" in caught.value.hint
