"""``restart`` on a host: the units of robots, and no others."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from swarmctl.render.bundle import Unit
from tests.onboard.agent.fakehost import FakeHost, Reply, bundle

UNITS = {"master.service": "", "koala.service": "koala", "khepera.service": "k3"}


@pytest.fixture
def host(tmp_path: Path) -> FakeHost:
    made = FakeHost(tmp_path)
    release = bundle("1", units=("master", "koala", "khepera"))
    units = tuple(Unit(one.name, one.needs, robot=UNITS[one.name]) for one in release.units)
    reply = made.apply(replace(release, units=units), start=list(UNITS))
    assert reply.answer, reply.error
    return made


def restart(host: FakeHost, *robots: str, **more: Any) -> Reply:
    return host.ask({"verb": "restart", "swarm": "new", "robots": list(robots), "others": not robots, **more})


@pytest.mark.parametrize(
    ("robots", "units"),
    [
        ((), ["koala.service", "khepera.service"]),
        (("k3",), ["khepera.service"]),
        (("nobody",), []),
    ],
)
def test_the_units_of_the_robots_restart(host: FakeHost, robots: tuple[str, ...], units: list[str]) -> None:
    host.calls()
    assert restart(host, *robots).answer == {"deployed": True, "restarted": units}
    done = [call.partition("restart -- ")[2] for call in host.calls() if "restart -- " in call]
    assert done == ([" ".join(units)] if units else [])


def test_nothing_restarts_where_nothing_is_deployed(tmp_path: Path) -> None:
    assert restart(FakeHost(tmp_path)).answer == {"deployed": False, "restarted": []}


def test_during_a_deploy_nothing_restarts(host: FakeHost) -> None:
    held = {"verb": "lease", "swarm": "new", "run": "a" * 16, "who": "anna@desk (7)", "want": True}
    host.ask(held)
    assert restart(host, "k3").error["message"] == "locked by anna@desk (7)"


@pytest.mark.parametrize("name", ["../x", "", "a b", 3])
def test_a_name_that_is_no_robots_is_refused(host: FakeHost, name: Any) -> None:
    assert restart(host, name).error["kind"] == "refused"
