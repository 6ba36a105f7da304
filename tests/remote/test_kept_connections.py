"""Connections that a process keeps for the next verb: one login for several verbs, and what ends them."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from multiprocessing import Pipe
from pathlib import Path
from typing import Any

import pytest

from swarmctl.remote import agent_client, kept_connections
from swarmctl.remote.connection_keeper import KEPT, Keeper
from swarmctl.remote.connections import Connections
from swarmctl.remote.either_ssh import EitherSsh
from swarmctl.remote.identities import Keyring
from swarmctl.remote.kept_connections import KeptConnections
from swarmctl.remote.parallel_hosts import Stop
from swarmctl.remote.transport import HostError, Kind, Session, Target
from tests.onboard.agent.fakehost import FakeHost
from tests.remote import sshd as servers
from tests.remote.conftest import NOWHERE
from tests.remote.test_agent_session import OBSERVE, agents, environment, host
from tests.timing import PATIENCE, wait_for

__all__ = ["host"]
Kept = KeptConnections


@pytest.fixture
def kept(tmp_path: Path) -> Iterator[Callable[[], Kept]]:
    """Makes what a verb connects with. The process that keeps connections ends with the test."""
    place = tmp_path / "keeper"

    def make() -> Kept:
        return KeptConnections(EitherSsh(keyring=Keyring(NOWHERE, use_agent=False)), place)

    yield make
    if (file := place.with_name("keeper.pid")).exists():
        os.kill(int(file.read_text()), signal.SIGKILL)


@pytest.fixture
def server(spare: Path, host: FakeHost) -> Iterator[servers.Sshd]:
    with servers.running(spare, extra=environment(host)) as found:
        yield found


def logins(server: servers.Sshd) -> int:
    return server.log.count("Accepted publickey")


def observed(transport: Kept, target: Target) -> Any:
    with transport.connect(target) as session, agent_client.agent_session(session) as agent:
        return agent.request(OBSERVE)


def test_verbs_share_one_login_and_one_agent(
    server: servers.Sshd, host: FakeHost, kept: Callable[[], Kept]
) -> None:
    assert observed(kept(), server.target())["release"] is None
    before = agents(host)
    assert observed(kept(), server.target())["release"] is None
    assert agents(host) == before
    assert (len(before), logins(server)) == (1, 1)


def test_a_confirmation_is_a_new_login(server: servers.Sshd, kept: Callable[[], Kept]) -> None:
    connections = Connections(kept(), Stop(), ("observe",))
    with connections.agent_session(server.target()) as agent:
        agent.request(OBSERVE)
    connections.log_in(server.target())
    assert logins(server) == 2
    with connections.agent_session(server.target(), anew=True) as agent:
        agent.request(OBSERVE)
    assert logins(server) == 3
    connections.close()


def test_another_pinned_key_is_not_served_by_what_is_kept(
    server: servers.Sshd, kept: Callable[[], Kept]
) -> None:
    observed(kept(), server.target())
    other = servers.make_key(server.folder / "other")
    with pytest.raises(HostError) as caught:
        observed(kept(), server.target(keys=(other,)))
    assert caught.value.kind is Kind.HOST_KEY
    with pytest.raises(HostError, match="was expelled"):
        observed(kept(), replace(server.target(), expelled=True))


def test_a_connection_that_was_lost_is_opened_anew(server: servers.Sshd, kept: Callable[[], Kept]) -> None:
    observed(kept(), server.target())
    server.end_connections()
    assert observed(kept(), server.target())["release"] is None
    assert logins(server) == 2


def test_a_verb_that_ends_in_a_request_ends_it(
    server: servers.Sshd, host: FakeHost, kept: Callable[[], Kept]
) -> None:
    observed(kept(), server.target())
    (process,) = agents(host)
    os.kill(process, signal.SIGSTOP)
    with kept().connect(server.target()) as session, agent_client.agent_session(session) as agent:
        ends = threading.Timer(0.1, session.close)
        ends.start()
        with pytest.raises(HostError) as caught:
            agent.request(OBSERVE, timeout=PATIENCE)
        ends.join()
    assert caught.value.kind is Kind.LOST
    os.kill(process, signal.SIGCONT)
    wait_for(lambda: process not in agents(host), complaint="the agent stayed")
    observed(kept(), server.target())
    assert logins(server) == 2


def test_an_agent_whose_code_was_removed_is_not_used(
    server: servers.Sshd, host: FakeHost, kept: Callable[[], Kept]
) -> None:
    with (
        kept().connect(server.target()) as session,
        agent_client.agent_session(session) as agent,
    ):
        agent.request({"verb": "remove", "swarm": "new", "who": "someone@laptop"})
    observed(kept(), server.target())
    assert logins(server) == 2


def test_a_process_that_was_killed_costs_the_request_alone(
    server: servers.Sshd, kept: Callable[[], Kept], tmp_path: Path
) -> None:
    with kept().connect(server.target()) as session:
        os.kill(int((tmp_path / "keeper.pid").read_text()), signal.SIGKILL)
        with agent_client.agent_session(session) as agent, pytest.raises(HostError) as caught:
            agent.request(OBSERVE)
    assert caught.value.kind is Kind.LOST
    assert observed(kept(), server.target())["release"] is None


def test_without_a_folder_of_its_own_nothing_is_kept(
    server: servers.Sshd, kept: Callable[[], Kept], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    (tmp_path / "swarmctl").mkdir(mode=0o755)
    transport = KeptConnections(EitherSsh(keyring=Keyring(NOWHERE, use_agent=False)))
    for _ in range(2):
        observed(transport, server.target())
    assert logins(server) == 2
    assert [*(tmp_path / "swarmctl").iterdir()] == []


def test_agents_and_networks_of_others_have_their_own_socket(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("SSH_AUTH_SOCK", "/run/one")
    one = kept_connections.socket_of_keeper()
    assert one == kept_connections.socket_of_keeper()
    monkeypatch.setenv("SSH_AUTH_SOCK", "/run/other")
    assert one != kept_connections.socket_of_keeper()
    assert one.parent.stat().st_mode & 0o777 == 0o700


class Opened:
    """Hosts without an agent, with which of them are connected."""

    def __init__(self) -> None:
        self.now: list[str] = []

    @contextmanager
    def connect(self, target: Target) -> Iterator[Session]:
        self.now.append(target.host)
        yield self  # type: ignore[misc]
        self.now.remove(target.host)

    def close(self) -> None:
        """A session has it."""


def test_what_nobody_uses_for_a_while_is_closed() -> None:
    now, hosts = [0.0], Opened()
    keeper = Keeper(hosts, lambda: now[0])
    ours, theirs = Pipe()
    serving = threading.Thread(target=keeper.serve, args=(theirs,))
    serving.start()
    ours.send(Target("pi", "192.0.2.1", "root"))
    assert ours.recv() is None
    now[0] += 2 * KEPT
    assert keeper.expire()
    assert hosts.now == ["pi"]  # in use
    ours.close()
    serving.join()
    now[0] += KEPT - 1
    assert keeper.expire()
    assert hosts.now == ["pi"]
    now[0] += 1
    keeper.expire()
    wait_for(lambda: not hosts.now, complaint="the connection stayed")
    now[0] += KEPT
    assert not keeper.expire()
