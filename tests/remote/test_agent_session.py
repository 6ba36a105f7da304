"""A session with the agent: many questions, one process and one channel; and how it ends."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from swarmctl.remote import agent_client
from swarmctl.remote.transport import HostError, Kind
from tests.onboard.agent.fakehost import FakeHost, bundle, payload_of, request_for
from tests.remote import sshd as servers
from tests.remote.conftest import AnySsh
from tests.timing import PATIENCE, wait_for

OBSERVE = {"verb": "observe", "swarm": "new"}
RELEASE = bundle("1")


@pytest.fixture
def host(tmp_path: Path) -> FakeHost:
    made = FakeHost(tmp_path / "host")
    (made.prefix / "home").mkdir()
    return made


def environment(host: FakeHost) -> str:
    return f"SetEnv SWARM_PREFIX={host.prefix} PATH={host.prefix}/bin:/usr/bin:/bin HOME={host.prefix}/home"


def agents(host: FakeHost) -> list[int]:
    """The processes of agents that work on this host."""
    mark = f"SWARM_PREFIX={host.prefix}\0".encode()
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            ours = (
                mark in (folder / "environ").read_bytes() and b"python" in (folder / "cmdline").read_bytes()
            )
        except OSError:
            continue
        if ours:
            found.append(int(folder.name))
    return found


def test_two_requests_are_answered_by_one_process_on_one_channel(
    spare: Path, host: FakeHost, transport: AnySsh
) -> None:
    with (
        servers.running(spare, extra=environment(host)) as server,
        transport.connect(server.target()) as session,
    ):
        with agent_client.agent_session(session) as first:  # after this the host keeps the agent
            first.request(OBSERVE)
        wait_for(lambda: not agents(host), complaint="the first agent stayed")
        before = server.log.count("Starting session: command")
        with agent_client.agent_session(session) as agent:
            assert agent.request(OBSERVE)["release"] is None
            (process,) = agents(host)
            notes: list[str] = []
            answer = agent.request(request_for(RELEASE), payload_of(RELEASE), on_note=notes.append)
            assert answer["release"] == agent.request(OBSERVE)["release"] == RELEASE.digest
            assert agents(host) == [process]
        assert notes[0] == "staging 6 files"
        assert server.log.count("Starting session: command") == before + 1
        wait_for(lambda: not agents(host), complaint="the agent stayed when the session was over")


def test_a_host_without_agent_gets_it_with_the_first_request(
    spare: Path, host: FakeHost, transport: AnySsh
) -> None:
    with (
        servers.running(spare, extra=environment(host)) as server,
        transport.connect(server.target()) as session,
        agent_client.agent_session(session) as agent,
    ):
        assert agent.request(OBSERVE)["release"] is None
        assert agent.request(request_for(RELEASE), payload_of(RELEASE))["release"] == RELEASE.digest
        assert server.log.count("Starting session: command") == 2


def test_an_answer_that_is_an_error_leaves_the_session_as_it_was(
    spare: Path, host: FakeHost, transport: AnySsh
) -> None:
    stale = request_for(RELEASE, previous="0" * 16)
    with (
        servers.running(spare, extra=environment(host)) as server,
        transport.connect(server.target()) as session,
        agent_client.agent_session(session) as agent,
    ):
        for request, payload in ((stale, payload_of(RELEASE)), ({"verb": "../../etc"}, b"x"), ({}, b"")):
            with pytest.raises(HostError):
                agent.request(request, payload)
        assert agent.request(request_for(RELEASE), payload_of(RELEASE))["release"] == RELEASE.digest


@pytest.mark.parametrize("noise", ["printf 'half a line'", "seq 2000"])
def test_noise_between_two_answers_does_not_matter(
    spare: Path, host: FakeHost, transport: AnySsh, noise: str
) -> None:
    # What the login shell leaves behind goes on printing while the agent answers.
    (host.prefix / "home/.bashrc").write_text(f"(for i in 1 2 3 4 5 6; do {noise}; sleep 0.1; done) &\n")
    with (
        servers.running(spare, extra=environment(host)) as server,
        transport.connect(server.target()) as session,
        agent_client.agent_session(session) as agent,
    ):
        for _ in range(4):
            assert agent.request(OBSERVE)["release"] is None
            time.sleep(0.15)


def test_a_host_that_dies_between_two_requests_is_lost_for_the_rest(
    spare: Path, host: FakeHost, transport: AnySsh
) -> None:
    with (
        servers.running(spare, extra=environment(host)) as server,
        transport.connect(server.target()) as session,
        agent_client.agent_session(session) as agent,
    ):
        agent.request(OBSERVE)
        for child in server.children():
            os.kill(child, signal.SIGKILL)
        for _ in range(2):
            with pytest.raises(HostError) as caught:
                agent.request(request_for(RELEASE), payload_of(RELEASE), timeout=PATIENCE)
            assert caught.value.kind is Kind.LOST
    assert not (host.prefix / "opt/swarm/new").exists()


def test_an_agent_that_dies_between_two_requests_is_an_error(
    spare: Path, host: FakeHost, transport: AnySsh
) -> None:
    with (
        servers.running(spare, extra=environment(host)) as server,
        transport.connect(server.target()) as session,
        agent_client.agent_session(session) as agent,
    ):
        agent.request(OBSERVE)
        for process in agents(host):
            os.kill(process, signal.SIGKILL)
        for _ in range(2):
            with pytest.raises(HostError, match="the agent ended without an answer") as caught:
                agent.request(OBSERVE, timeout=PATIENCE)
            assert caught.value.kind is Kind.LOST


@pytest.mark.parametrize(
    ("prints", "shown"),
    [
        ("echo This account is currently not available.; exit 1", "This account is currently not available."),
        ("echo Backups only.; echo; echo Ask Ann.", "Backups only. Ask Ann."),
        ("printf %01000d 7", "0" * 300),
    ],
)
def test_what_a_host_prints_instead_of_an_answer_is_shown(
    prints: str, shown: str, spare: Path, transport: AnySsh
) -> None:
    with (
        servers.running(spare, extra=f"ForceCommand {prints}") as server,
        transport.connect(server.target()) as session,
        agent_client.agent_session(session) as agent,
        pytest.raises(HostError) as caught,
    ):
        agent.request(OBSERVE, timeout=PATIENCE)
    assert caught.value.message.endswith(f"): {shown}")
    assert "forced command" in caught.value.hint


@pytest.mark.parametrize("program", ["false", "true"])
def test_a_login_shell_that_runs_no_command_is_named(program: str, spare: Path, transport: AnySsh) -> None:
    with (
        servers.running(spare, extra=f"ForceCommand {program}") as server,
        transport.connect(server.target()) as session,
        agent_client.agent_session(session) as agent,
        pytest.raises(HostError) as caught,
    ):
        agent.request(OBSERVE, timeout=PATIENCE)
    assert "as /bin/false does" in caught.value.message
    assert "usermod -s" in caught.value.hint


def test_a_umask_of_the_login_does_not_hide_a_release(spare: Path, host: FakeHost, transport: AnySsh) -> None:
    extra = f'{environment(host)}\nForceCommand umask 0077; eval "$SSH_ORIGINAL_COMMAND"'
    with (
        servers.running(spare, extra=extra) as server,
        transport.connect(server.target()) as session,
        agent_client.agent_session(session) as agent,
    ):
        agent.request(request_for(RELEASE), payload_of(RELEASE), timeout=PATIENCE)
    for path in (host.prefix / "opt/swarm", *(host.prefix / "opt/swarm").rglob("*")):
        if not path.is_symlink() and path.name != "lock":  # which other accounts could hold
            assert oct(path.stat().st_mode & 0o444) == "0o444", path


def test_an_operator_that_dies_leaves_no_agent_running(
    spare: Path, host: FakeHost, transport: AnySsh
) -> None:
    with (
        servers.running(spare, extra=environment(host)) as server,
        transport.connect(server.target()) as session,
        agent_client.agent_session(session) as agent,
    ):
        agent.request(OBSERVE)
        assert agents(host)
        session.close()
        wait_for(lambda: not agents(host))


def test_a_request_without_answer_in_time_ends_the_session(
    spare: Path, host: FakeHost, transport: AnySsh
) -> None:
    host.apply(RELEASE)
    (host.prefix / "slow").touch()
    stop = {"previous": RELEASE.digest, "stop": ["koala.service"], "start": []}
    with (
        servers.running(spare, extra=environment(host)) as server,
        transport.connect(server.target()) as session,
        agent_client.agent_session(session) as agent,
    ):
        agent.request(OBSERVE)
        for _ in range(2):
            with pytest.raises(HostError, match=r"did not finish within 0\.2 s"):
                agent.request(request_for(RELEASE, **stop), payload_of(RELEASE), timeout=0.2)
    wait_for(lambda: not agents(host))
    assert host.observe().transaction.state == "applied"


def test_a_flood_ends_the_session_and_is_not_an_answer(
    spare: Path, host: FakeHost, transport: AnySsh, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(agent_client, "_LONGEST_ANSWER", 5000)
    (host.prefix / "home/.bashrc").write_text("seq 2000\n")
    with (
        servers.running(spare, extra=environment(host)) as server,
        transport.connect(server.target()) as session,
        agent_client.agent_session(session) as agent,
    ):
        for _ in range(2):
            with pytest.raises(HostError, match="more than 5000 bytes"):
                agent.request(OBSERVE)
