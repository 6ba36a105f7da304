"""A verb of a host is one module: written into a copy of the on-robot package, and called on hosts."""

from __future__ import annotations

import importlib
import shutil
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from swarm_onboard.agent import verbs

from swarmctl import onboard_archive
from swarmctl.remote.ask import ask_each
from swarmctl.remote.parallel_hosts import results_of
from swarmctl.remote.transport import HostError, Kind, Session, Target
from swarmctl.resources import onboard
from tests.onboard.agent.fakehost import FakeHost
from tests.onboard.agent.local_session import LocalSession

VERB = '''
"""``shells``: the login shells of the host."""

from __future__ import annotations

from swarm_onboard.agent.named_tuple import NamedTuple


class Request(NamedTuple):
    swarm: str
    most: int


class Shell(NamedTuple):
    path: str
    fits: bool


class Answer(NamedTuple):
    shells: list[Shell]


def handle(request, payload, report):
    if request.most < 0:
        return Answer(["/bin/sh"])
    return Answer([Shell(name, name == "/bin/sh") for name in ("/bin/sh", "/bin/csh")][: request.most])
'''


class Hosts:
    """A transport to hosts in folders."""

    def __init__(self, hosts: Mapping[str, FakeHost]) -> None:
        self._hosts = hosts

    @contextmanager
    def connect(self, target: Target) -> Iterator[Session]:
        yield LocalSession(self._hosts[target.host].environment())


@pytest.fixture
def verb(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    package = tmp_path / "swarm_onboard"
    shutil.copytree(onboard(), package, ignore=shutil.ignore_patterns("__pycache__"))
    (package / "agent/verbs/shells.py").write_text(VERB)
    monkeypatch.setattr(onboard_archive, "onboard", lambda: package)
    monkeypatch.setattr(verbs, "__path__", [*verbs.__path__, str(package / "agent/verbs")])
    name = f"{verbs.__name__}.shells"
    yield importlib.import_module(name)
    del sys.modules[name]


def test_a_verb_is_one_module(verb: Any, tmp_path: Path) -> None:
    hosts = {name: FakeHost(tmp_path / name) for name in ("a", "b", "c")}
    for host in hosts.values():
        (host.prefix / "bin/sudo").write_text('#!/bin/sh\nshift\nexec "$@"\n')
        (host.prefix / "bin/sudo").chmod(0o755)
    targets = {name: Target(name, "192.0.2.1", "robot") for name in hosts}
    requests = {name: verb.Request("new", most) for name, most in (("a", 1), ("b", -1), ("c", "many"))}
    found = results_of(ask_each(verb.handle, requests, targets, Hosts(hosts), parallel=3))
    assert found["a"] == verb.Answer([verb.Shell("/bin/sh", True)])
    for name, words in (("b", "the answer to `shells` does not fit: shells.0"), ("c", "TypeError")):
        error = found[name]
        assert isinstance(error, HostError)
        assert (error.kind, words in error.message) == (Kind.PROTOCOL, True)
