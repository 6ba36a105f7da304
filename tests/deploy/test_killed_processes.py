"""kill -9 of the operator, of the connection's sshd, of the agent, in every state of a deploy over SSH; of a
jump host's connections amid it.

Afterwards the host is old or new, the report is true, and the next run completes what was begun.
"""

from __future__ import annotations

import multiprocessing
import os
import shutil
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from swarm_onboard.agent import lease
from swarm_onboard.agent.release_store import Home

from swarmctl.deploy.host_transaction import Terms
from swarmctl.deploy.outcome import Outcome
from swarmctl.remote.agent_client import DirectAgentSession
from swarmctl.remote.ssh import SshTransport
from swarmctl.remote.ssh_channel import SshChannel
from swarmctl.remote.transport import Target
from tests.deploy.deploying import deploy
from tests.deploy.test_rollout import TARGETS, FolderTransport, bundles, deployed
from tests.onboard.agent.fakehost import FakeHost
from tests.remote import sshd
from tests.timing import PATIENCE

LACKS = sshd.missing()
pytestmark = pytest.mark.skipif(bool(LACKS), reason=f"sshd needs {LACKS}")

OLD, NEW = bundles()["k3"], bundles(k3="speed: 2\n")["k3"]
UNIT = "new.robot.service"
SOON = 0.1  # s
STATES = (
    "survey",
    "lease",
    "upload",
    "change",
    "applied",
    "hold",
    "confirm",
    "confirmed",
    "give back",
)
_FORK = multiprocessing.get_context("fork")

Kill = Callable[[], None]


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[sshd.Sshd, Path]]:
    """A host's sshd, and the link by which it finds the host's folder."""
    place = tmp_path_factory.mktemp("host") / "now"
    extra = f"SetEnv SWARM_PREFIX={place} PATH={place}/bin:/usr/bin:/bin HOME={place}"
    with sshd.running(tmp_path_factory.mktemp("sshd"), extra=extra) as running:
        yield running, place


@pytest.fixture(scope="module")
def gate(tmp_path_factory: pytest.TempPathFactory) -> Iterator[sshd.Sshd]:
    """A jump host."""
    with sshd.running(tmp_path_factory.mktemp("gate")) as running:
        yield running


@pytest.fixture(scope="module")
def deployed_host(server: tuple[sshd.Sshd, Path], tmp_path_factory: pytest.TempPathFactory) -> FakeHost:
    """A host with a release; each test has a copy in its place."""
    _, place = server
    place.symlink_to(tmp_path_factory.mktemp("deployed"))
    made = FakeHost(place)
    sudo = place / "bin/sudo"
    sudo.write_text('#!/bin/sh\nshift\nexec "$@"\n')
    sudo.chmod(0o755)
    assert isinstance(
        deployed(deploy({"k3": OLD}, TARGETS, FolderTransport({"k3": made}, {})))["k3"], Outcome
    )
    return made


@pytest.fixture
def host(deployed_host: FakeHost, tmp_path: Path) -> Iterator[FakeHost]:
    place = deployed_host.prefix
    kept = place.readlink()
    shutil.copytree(kept, tmp_path / "host", symlinks=True)
    place.unlink()
    place.symlink_to(tmp_path / "host")
    yield deployed_host
    place.unlink()
    place.symlink_to(kept)


def killed_at(state: str, kill: Kill) -> None:
    """Has ``kill`` be called once, when a deploy of this process is in ``state``."""
    ask, exchange = DirectAgentSession.request, SshChannel.exchange
    once = threading.Lock()

    def now() -> None:
        if once.acquire(blocking=False):
            kill()

    def asking(self: DirectAgentSession, request: Any, payload: bytes = b"", **more: Any) -> Any:
        verb = "give back" if request.get("want") is False else request["verb"]
        if verb == state:
            now()
        if (verb, state) == ("apply", "change"):
            note = more["on_note"]
            more["on_note"] = lambda text: (note(text), text.startswith("stopping") and now())
        if (verb, state) == ("hold", "hold"):
            threading.Timer(SOON, now).start()
        answer = ask(self, request, payload, **more)
        if (verb, state) in AFTER:
            now()
        return answer

    def cut(self: SshChannel, stdin: Sequence[bytes], *rest: Any, **more: Any) -> Any:
        if state == "upload" and len(stdin) > 1 and b'"verb":"apply"' in stdin[-2]:
            threading.Timer(SOON, now).start()
            stdin = [*stdin[:-1], stdin[-1][: len(stdin[-1]) // 2]]
        return exchange(self, stdin, *rest, **more)

    DirectAgentSession.request = asking  # type: ignore[method-assign]
    SshChannel.exchange = cut  # type: ignore[method-assign]


AFTER = {("observe", "survey"), ("lease", "lease"), ("apply", "applied"), ("confirm", "confirmed")}


def operator(target: Target, terms: Terms, answers: Any, prepare: Callable[[], None] = lambda: None) -> None:
    """A run of its own, which deploys the next release."""
    prepare()
    events = deploy({"k3": NEW}, {"k3": target}, SshTransport(), terms=terms)
    found = deployed(events)["k3"]
    answers.put("" if isinstance(found, Outcome) else f"{found.kind.value}: {found}")


def reported(*arguments: Any) -> str | None:
    """What an operator reports: an error, or empty text. None if it was killed."""
    answers = _FORK.SimpleQueue()
    process = _FORK.Process(target=operator, args=(*arguments[:2], answers, *arguments[2:]))
    process.start()
    process.join(PATIENCE)
    assert process.exitcode in (0, -signal.SIGKILL)
    return None if process.exitcode else answers.get()


def kill_all(processes: Sequence[int]) -> None:
    for process in processes:
        with suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)


def below(process: int) -> list[int]:
    """The descendants of a process."""
    with suppress(FileNotFoundError, ProcessLookupError):
        words = Path(f"/proc/{process}/task/{process}/children").read_text().split()
        return [one for word in words for one in (int(word), *below(int(word)))]
    return []


def named(process: int, name: str) -> bool:
    with suppress(FileNotFoundError, ProcessLookupError):
        return Path(f"/proc/{process}/comm").read_text().startswith(name)
    return False


VICTIMS: dict[str, Callable[[int], None]] = {
    "operator": lambda _: os.kill(os.getpid(), signal.SIGKILL),
    "sshd": lambda master: kill_all([one for one in below(master) if named(one, "sshd")]),
    "agent": lambda master: kill_all([one for one in below(master) if named(one, "python3")]),
}


CASES = [(state, victim) for state in STATES for victim in ("operator", "sshd")]
CASES += [(state, "agent") for state in ("survey", "hold", "confirm")]  # its own steps: test_undo.py


@pytest.mark.parametrize(("state", "victim"), CASES)
@pytest.mark.slow
def test_after_a_kill_in_any_state_the_next_run_completes(
    host: FakeHost, server: tuple[sshd.Sshd, Path], state: str, victim: str
) -> None:
    running, _ = server
    target = replace(running.target(), host="k3")
    within = 1 if victim == "operator" else PATIENCE
    terms = Terms(healthy_for=3 * SOON, healthy_within=PATIENCE, confirm_within=within)

    report = reported(target, terms, lambda: killed_at(state, lambda: VICTIMS[victim](running.process.pid)))
    _completes(host, target, victim, report)


@pytest.mark.parametrize("state", ["survey", "upload", "change", "hold", "confirm"])
@pytest.mark.slow
def test_after_a_jump_host_dies_the_next_run_completes(
    host: FakeHost, server: tuple[sshd.Sshd, Path], gate: sshd.Sshd, state: str
) -> None:
    """It is back at once, as one that was switched off and on; its connections are not."""
    target = replace(server[0].target(), host="k3", jump=gate.target(host="gate"))
    terms = Terms(healthy_for=3 * SOON, healthy_within=PATIENCE, confirm_within=PATIENCE)
    report = reported(target, terms, lambda: killed_at(state, lambda: VICTIMS["sshd"](gate.process.pid)))
    _completes(host, target, "gate", report)


def _completes(host: FakeHost, target: Target, victim: str, report: str | None) -> None:
    """The host is old or new, and ``report`` true; the next run completes what was begun."""
    recovered = host.recover()  # what the recovery unit does meanwhile

    assert recovered == 0
    seen = host.observe()
    assert seen.release in (OLD.digest, NEW.digest)
    assert seen.drift == ({}, {}, {})
    assert seen.transaction.state in ("applied", "undone")
    assert host.units() == {UNIT: seen.release}
    assert (report is None) == (victim == "operator")
    if report is not None:
        assert (report == "") == (seen.release == NEW.digest), report
    if victim == "agent":
        assert report == ""
    held = lease.read(Home("new", str(host.prefix)))
    assert held.left(Home("new", str(host.prefix))) <= lease.SECONDS

    assert reported(target, Terms(healthy_for=SOON)) == ""

    assert host.observe().release == NEW.digest
    assert host.units() == {UNIT: NEW.digest}
