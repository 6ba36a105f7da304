"""Hosts with old algorithms, few sessions, or the address of another."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.remote import agent_client
from swarmctl.remote.known_hosts import KnownHosts, fingerprint
from swarmctl.remote.transport import HostError, Kind
from tests.remote import sshd as servers
from tests.remote.conftest import AnySsh
from tests.remote.sshd import Sshd


@pytest.mark.parametrize(
    ("extra", "offered"),
    [
        ("HostKeyAlgorithms ssh-rsa", "ssh-rsa"),
        ("KexAlgorithms diffie-hellman-group1-sha1", "diffie-hellman-group1-sha1"),
        ("Ciphers aes256-cbc", "aes256-cbc"),
        ("Ciphers aes256-ctr\nMACs hmac-md5", "hmac-md5"),
    ],
)
def test_what_an_old_host_offers_is_named(spare: Path, transport: AnySsh, extra: str, offered: str) -> None:
    kind = "rsa" if "ssh-rsa" in extra else "ed25519"
    with (
        servers.running(spare, kinds=(kind,), extra=extra) as server,
        pytest.raises(HostError) as caught,
        transport.connect(server.target()),
    ):
        pass
    assert caught.value.kind is Kind.UNREACHABLE
    assert f"{offered}" in caught.value.message
    assert caught.value.message.startswith("pi (127.0.0.1")
    assert "ProxyJump" in caught.value.hint


def test_two_hosts_that_exchanged_addresses_are_both_refused(
    spare: Path, sshd: Sshd, transport: AnySsh
) -> None:
    with servers.running(spare) as other:
        known = KnownHosts()
        for name, server in (("k3", sshd), ("k4", other)):
            known = known.pinned(name, "127.0.0.1", server.port, server.keys[-1:])
        for name, server, own in (("k3", other, sshd), ("k4", sshd, other)):
            keys = known.keys(name, "127.0.0.1", server.port)
            with (
                pytest.raises(HostError) as caught,
                transport.connect(server.target(host=name, keys=keys)),
            ):
                pass
            assert caught.value.kind is Kind.HOST_KEY
            assert caught.value.message.startswith(f"{name} ")
            assert fingerprint(own.keys[-1]) in caught.value.message
        assert "Accepted" not in other.log


def test_one_session_a_connection_is_enough(spare: Path, tmp_path: Path, transport: AnySsh) -> None:
    for folder in ("opt", "etc", "run/systemd/system", "home"):
        (tmp_path / "host" / folder).mkdir(parents=True)
    prefix = f"SetEnv SWARM_PREFIX={tmp_path}/host HOME={tmp_path}/host/home"
    with (
        servers.running(spare, extra=f"MaxSessions 1\n{prefix}") as server,
        transport.connect(server.target()) as session,
        agent_client.agent_session(session) as host,
    ):
        for _ in range(2):
            assert host.request({"verb": "observe", "swarm": "new"})
