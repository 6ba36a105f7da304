"""The systems of hosts, as their agents know them."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from swarmctl.deploy.host_systems import systems
from swarmctl.remote.transport import HostError, Kind, Session, Target
from tests.deploy.test_trial_start import hosts
from tests.seams.test_a_new_verb import Hosts


def test_each_host_that_answers_has_its_system(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    transport, targets = hosts(tmp_path)
    (tmp_path / "a/etc/os-release").write_text('ID=debian\nVERSION_ID="12"\n')

    @contextmanager
    def connect(self: Hosts, target: Target) -> Iterator[Session]:
        if target.host == "b":
            raise HostError(Kind.UNREACHABLE, "no answer")
        with there(self, target) as session:
            yield session

    there = Hosts.connect
    monkeypatch.setattr(Hosts, "connect", connect)
    found = systems("new", {}, targets, transport, parallel=2)
    assert set(found) == {"a"}
    assert found["a"].platform == f"debian-12-{os.uname().machine}"
    assert re.fullmatch(r"3\.\d+\.\d+\S*", found["a"].python)
