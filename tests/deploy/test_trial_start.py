"""A trial on several hosts: each answers with its clock, and one instant is right for all."""

from __future__ import annotations

from pathlib import Path

import pytest
from swarm_onboard.agent.verbs import trial

from swarmctl.deploy import trial_start
from swarmctl.remote.parallel_hosts import results_of
from swarmctl.remote.transport import HostError, Kind, Target
from tests.onboard.agent.change import OLD
from tests.onboard.agent.fakehost import FakeHost
from tests.seams.test_a_new_verb import Hosts


def test_the_instant_is_ahead_of_the_latest_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trial_start.time, "time", lambda: 100.0)
    clocks = {name: trial_start.Clock(ahead, 0.01) for name, ahead in (("a", 0.0), ("b", 7.5), ("c", -1.0))}
    assert trial_start.instant(clocks, 3.0) == 110.5


def hosts(folder: Path) -> tuple[Hosts, dict[str, Target]]:
    """A transport to two hosts in folders; `a` has a release."""
    made = {name: FakeHost(folder / name) for name in "ab"}
    for host in made.values():
        (host.prefix / "bin/sudo").write_text('#!/bin/sh\nshift\nexec "$@"\n')
        (host.prefix / "bin/sudo").chmod(0o755)
    assert made["a"].apply(OLD).answer
    return Hosts(made), {name: Target(name, "192.0.2.1", "robot") for name in made}


def test_every_host_shows_its_clock(tmp_path: Path) -> None:
    transport, targets = hosts(tmp_path)
    found = results_of(trial_start.seen("new", targets, transport, 2))
    for name, deployed in (("a", True), ("b", False)):
        one = found[name]
        assert not isinstance(one, HostError)
        assert one.answer.deployed == deployed
        assert one.answer.free > 0
        assert abs(one.clock.ahead) <= one.clock.error, "this machine's clock is that of the host"


def test_each_host_gets_its_own_request(tmp_path: Path) -> None:
    transport, targets = hosts(tmp_path)
    requests = {"a": trial.Request("new", "me", [], ["koala.service"], [], 1.0, 9.0)}
    found = results_of(trial_start.start(requests, targets, transport, parallel=2))
    assert set(found) == {"a"}
    assert isinstance(found["a"], HostError)
    assert (found["a"].kind, "by the clock of this host" in found["a"].message) == (Kind.REFUSED, True)
