"""A deploy waits for robots that must not be touched now, before it changes any host."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from swarmctl.deploy.deployment import Deployment
from swarmctl.deploy.outcome import Rules
from swarmctl.remote.parallel_hosts import Note
from swarmctl.remote.transport import Kind
from swarmctl.render.bundle import Bundle, File
from tests.deploy.deploying import deploy
from tests.deploy.test_rollout import TARGETS, FolderTransport, bundles, deployed
from tests.onboard.agent.fakehost import FakeHost
from tests.onboard.agent.test_stop import running

QUIET = {"commander": "", "measured": False, "zero_at": 1.0, "still_since": None}


def release(speed: str, idle: float) -> dict[str, Bundle]:
    made = bundles(k3=f"speed: {speed}\n")["k3"]
    terms = File("maintenance.json", json.dumps({"k3": {"idle": idle, "battery": 0.0}}).encode())
    (unit,) = made.units
    return {"k3": replace(made, files=(*made.files, terms), units=(replace(unit, robot="k3"),))}


@contextmanager
def surveyed(host: FakeHost, idle: float, wait: float) -> Iterator[tuple[Deployment, list[str]]]:
    """A survey for a change of the driver of k3, whose last command is just over."""
    way = FolderTransport({"k3": host}, {})
    deployed(deploy(release("1", idle), TARGETS, way))
    with (
        running(host.prefix, "k3", swarm="new", **QUIET, idle_since=time.monotonic()),
        Deployment(release("2", idle), TARGETS, way, rules=Rules(wait=wait), parallel=4) as deployment,
    ):
        yield deployment, [event.text for event in deployment.survey() if isinstance(event, Note)]


@pytest.fixture
def k3(tmp_path: Path) -> FakeHost:
    return FakeHost(tmp_path)


def test_it_goes_on_once_the_terms_hold(k3: FakeHost) -> None:
    with surveyed(k3, idle=2.0, wait=120.0) as (deployment, _):
        assert deployment.errors == {}
        assert [one.host for one in deployment.due] == ["k3"]


def test_it_waits_no_longer_than_it_may_and_says_what_for(k3: FakeHost) -> None:
    with surveyed(k3, idle=86400.0, wait=3.0) as (deployment, notes):
        error = deployment.errors["k3"]
        assert error.kind is Kind.BUSY
        assert str(error).startswith("k3 has been idle for ")
        assert len([one for one in notes if one.startswith("waiting: k3 has been idle for ")]) == 1
