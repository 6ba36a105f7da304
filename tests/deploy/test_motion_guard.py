"""Units on which robots of other hosts depend do not stop while these robots are in use.

The hosts are folders with the real agent; a loop as that of a driver answers for the Khepera on `k3`.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from swarm_onboard.agent.paths import stop_file

from swarmctl.deploy import rollout
from swarmctl.deploy.deployment import Deployment
from swarmctl.deploy.host_transaction import Terms
from swarmctl.deploy.outcome import Outcome, Removed, Rules
from swarmctl.deploy.rollback import Rollback
from swarmctl.plan.robots_in_use import Dependents
from swarmctl.plan.waves import order
from swarmctl.remote import parallel_hosts
from swarmctl.remote.parallel_hosts import Note
from swarmctl.remote.transport import HostError, Kind
from swarmctl.render.bundle import Bundle, File, Unit
from tests.deploy.deploying import deploy
from tests.deploy.test_rollout import TARGETS, FolderTransport, deployed, hosts
from tests.loading import load_swarm
from tests.onboard.agent.fakehost import FakeHost
from tests.onboard.agent.test_stop import running
from tests.timing import PATIENCE

__all__ = ["hosts"]

SPEC = """
version: 1
name: new
mode: leader
leader: leader
hosts:
  leader: {address: 192.168.77.10}
  k3: {address: 192.168.77.11}
  epuck: {address: 192.168.77.12, bluetooth: [hci0]}
robots:
  k3: {type: khepera3, host: k3}
  epuck: {type: epuck, host: epuck}
links:
  - {kind: wlan, name: lab, hosts: [leader, k3, epuck]}
  - {kind: serial, host: k3, robot: k3, usb: {serial: FTDI1234}}
  - {kind: bluetooth, host: epuck, robot: epuck, mac: "10:00:e8:c5:64:37"}
programs:
  joystick: {host: leader, use: teleop-joy}
control: [{by: joystick, of: [k3, epuck]}]
time: {root: leader}
"""
UNITS = {"leader": "joystick", "k3": "k3", "epuck": "epuck"}
IN_USE = {"commander": "joystick (/joystick)", "measured": False, "zero_at": 1.0, "still_since": None}
TURNS = {**IN_USE, "measured": True}
NOT_NOW = "k3 on k3 is commanded by joystick (/joystick), and depends on swarm-new.joystick.service"
AWAY = HostError(Kind.UNREACHABLE, "192.0.2.1 port 22: no route to host")
AT_ONCE = Terms(healthy_for=0.1, healthy_within=5)


@pytest.fixture(scope="module")
def dependents(tmp_path_factory: pytest.TempPathFactory) -> Dependents:
    path = tmp_path_factory.mktemp("spec") / "swarm.yaml"
    path.write_text(SPEC)
    swarm, found = load_swarm(path)
    assert swarm is not None, found
    return Dependents(swarm)


def bundles(*changed: str) -> dict[str, Bundle]:
    """A release a host: on the leader the joystick, elsewhere a driver."""

    def one(host: str, part: str) -> Bundle:
        name = f"swarm-new.{part}.service"
        unit = File(f"units/{name}", b"[Service]\nExecStart=/bin/true\n")
        text = File(f"params/{part}.yaml", b"speed: 2\n" if host in changed else b"speed: 1\n")
        made = Unit(name, (unit.path, text.path), robot="" if host == "leader" else part)
        return Bundle(
            (unit, text), (made,), {f"/etc/systemd/system/{name}": unit.path}, swarm="new", host=host
        )

    return {host: one(host, part) for host, part in UNITS.items()}


@pytest.fixture
def run_by(hosts: dict[str, FakeHost]) -> dict[str, FakeHost]:
    """The hosts, with a first release."""
    done = deployed(deploy(bundles(), TARGETS, FolderTransport(hosts, {})))
    assert all(isinstance(one, Outcome) for one in done.values()), done
    return hosts


@contextmanager
def surveyed(
    dependents: Dependents, hosts: Mapping[str, FakeHost], wanted: Mapping[str, Bundle], **more: Any
) -> Iterator[tuple[Deployment, list[str]]]:
    """A deployment after its survey, and what the survey noted."""
    broken = more.pop("broken", {})
    rules = Rules(terms=AT_ONCE, **more)
    way = FolderTransport(hosts, broken)
    with Deployment(wanted, TARGETS, way, rules=rules, dependents=dependents, parallel=4) as deployment:
        yield deployment, [event.text for event in deployment.survey() if isinstance(event, Note)]


def executed(deployment: Deployment) -> dict[str, bool | str]:
    """By host whether it changed, or why it did not."""
    events = deployment.change(order(deployment.due, (), ("100%",), "independent"))
    return {
        host: str(one) if isinstance(one, HostError) else one.changed
        for host, one in deployed(events).items()
    }


def speed(host: FakeHost, part: str) -> bytes:
    return host.read(f"opt/swarm/new/current/params/{part}.yaml")


def test_a_commander_is_not_restarted_under_a_robot_of_another_host(
    run_by: dict[str, FakeHost], dependents: Dependents
) -> None:
    wanted = bundles("leader", "epuck")
    with (
        running(run_by["k3"].prefix, "k3", swarm="new", **IN_USE),
        surveyed(dependents, run_by, wanted) as (deployment, _),
    ):
        assert {host: str(one) for host, one in deployment.errors.items()} == {"leader": NOT_NOW}
        assert deployment.held
        assert "--stop-robots" in deployment.errors["leader"].hint
        assert executed(deployment) == {
            "leader": NOT_NOW, "k3": False,
            "epuck": "nothing was changed, since leader has a robot that must not be touched now",
        }  # fmt: skip
    assert speed(run_by["epuck"], "epuck") == b"speed: 1\n"


@pytest.mark.parametrize(
    "motion",
    [
        {**IN_USE, "commander": "k3 (/k3/own)"},
        {**IN_USE, "commander": "nobody"},
        {**IN_USE, "held": True},
    ],
)
def test_robots_that_do_not_depend_on_it_hold_nothing_back(
    run_by: dict[str, FakeHost], dependents: Dependents, motion: dict[str, object]
) -> None:
    with (
        running(run_by["k3"].prefix, "k3", swarm="new", **motion),
        surveyed(dependents, run_by, bundles("leader")) as (deployment, _),
    ):
        assert executed(deployment) == {"leader": True, "k3": False, "epuck": False}


def test_they_are_stopped_on_their_hosts_before_any_host_changes(
    run_by: dict[str, FakeHost], dependents: Dependents
) -> None:
    latch = Path(f"{run_by['k3'].prefix}{stop_file('new', 'k3')}")
    wanted = bundles("leader", "epuck")
    with running(run_by["k3"].prefix, "k3", swarm="new", **TURNS) as commands:
        with surveyed(dependents, run_by, wanted, stop_robots=True) as (deployment, _):
            assert not deployment.errors
            assert not latch.exists()  # nothing is stopped before the question
            results = executed(deployment)
        assert commands.held
        assert "and is not confirmed to stand: k3 was sent its stop, and its wheels still turn" in str(
            results["leader"]
        )
        assert "nothing was changed" in str(results["epuck"])
    latch.unlink()
    with running(run_by["k3"].prefix, "k3", part=".gate", swarm="new", **IN_USE) as commands:
        with surveyed(dependents, run_by, wanted, stop_robots=True) as (deployment, _):
            assert executed(deployment) == {"leader": True, "k3": False, "epuck": True}
        assert commands.held
    assert latch.exists()  # until `swarmctl start`


def test_a_robot_that_is_used_after_the_survey_keeps_the_change_away(
    run_by: dict[str, FakeHost], dependents: Dependents
) -> None:
    with surveyed(dependents, run_by, bundles("leader")) as (deployment, _):
        assert not deployment.errors
        with running(run_by["k3"].prefix, "k3", swarm="new", **IN_USE):
            assert executed(deployment)["leader"] == NOT_NOW
    assert speed(run_by["leader"], "joystick") == b"speed: 1\n"


def test_hosts_outside_the_selection_count_too(run_by: dict[str, FakeHost], dependents: Dependents) -> None:
    wanted = {"leader": bundles("leader")["leader"]}
    with running(run_by["k3"].prefix, "k3", swarm="new", **IN_USE):
        with surveyed(dependents, run_by, wanted) as (deployment, _):
            assert str(deployment.errors["leader"]) == NOT_NOW
        with surveyed(dependents, run_by, wanted, stop_robots=True) as (deployment, _):
            assert executed(deployment) == {"leader": True}


def test_what_a_silent_host_does_is_not_known(run_by: dict[str, FakeHost], dependents: Dependents) -> None:
    wanted = {"leader": bundles("leader")["leader"]}
    with surveyed(dependents, run_by, wanted, broken={"k3": AWAY}) as (deployment, _):
        error = deployment.errors["leader"]
        assert str(error) == (f"k3 on k3 may be in use: {AWAY}, and depends on swarm-new.joystick.service")
        assert "--keep-going" in error.hint
    going = {"most_failed": None, "broken": {"k3": AWAY}}
    with surveyed(dependents, run_by, wanted, **going) as (deployment, notes):
        assert notes == [f"k3 may be in use: {AWAY}"]
        assert executed(deployment) == {"leader": True}


def test_an_optional_host_that_is_away_holds_nothing_back(
    run_by: dict[str, FakeHost], dependents: Dependents
) -> None:
    swarm = dependents.swarm
    away = replace(swarm, hosts={**swarm.hosts, "k3": replace(swarm.hosts["k3"], optional=True)})
    wanted = {"leader": bundles("leader")["leader"]}
    with surveyed(Dependents(away), run_by, wanted, broken={"k3": AWAY}) as (deployment, notes):
        assert notes == [f"k3 may be in use: {AWAY}"]
        assert executed(deployment) == {"leader": True}


def test_a_deploy_waits_for_them(run_by: dict[str, FakeHost], dependents: Dependents) -> None:
    def drives(until: threading.Event) -> None:
        with running(run_by["k3"].prefix, "k3", swarm="new", **IN_USE):
            until.wait(PATIENCE)
        (run_by["k3"].prefix / "run/swarm-new.k3/motion").unlink()  # as systemd does

    parked = threading.Event()
    driver = threading.Thread(target=drives, args=(parked,))
    driver.start()
    rules = Rules(terms=AT_ONCE, wait=60.0)
    way = FolderTransport(run_by, {})
    with Deployment(
        bundles("leader"), TARGETS, way, rules=rules, dependents=dependents, parallel=4
    ) as deployment:
        notes = []
        for event in deployment.survey():
            if isinstance(event, Note):
                notes.append(event.text)
                parked.set()
        assert notes == [f"waiting: {NOT_NOW}"]
        assert executed(deployment)["leader"] is True
    driver.join()


def test_a_rollback_is_refused_as_a_deploy_is(run_by: dict[str, FakeHost], dependents: Dependents) -> None:
    done = deployed(deploy(bundles("leader", "epuck"), TARGETS, FolderTransport(run_by, {})))
    assert all(isinstance(one, Outcome) for one in done.values()), done
    way = FolderTransport(run_by, {})

    def going_back(**more: Any) -> Rollback:
        return Rollback(
            bundles(), TARGETS, way, rules=Rules(terms=AT_ONCE, **more), dependents=dependents, parallel=4
        )

    with running(run_by["k3"].prefix, "k3", swarm="new", **IN_USE) as commands:
        with going_back() as refused:
            for _ in refused.survey():
                pass
            assert {host: str(one) for host, one in refused.errors.items()} == {"leader": NOT_NOW}
        with going_back(stop_robots=True) as going:
            for _ in going.survey():
                pass
            assert executed(going) == {"leader": True, "k3": False, "epuck": True}
        assert commands.held
    with (
        running(run_by["epuck"].prefix, "epuck", swarm="new", **IN_USE),
        going_back() as own,
    ):
        for _ in own.survey():
            pass
        assert "epuck is commanded by joystick" in str(own.errors["epuck"])


def test_a_removal_leaves_the_units_of_robots_in_use(
    run_by: dict[str, FakeHost], dependents: Dependents
) -> None:
    def removed(*names: str, **more: Any) -> dict[str, Any]:
        way = FolderTransport(run_by, {"epuck": AWAY})
        events = rollout.remove(names, TARGETS, way, dependents=dependents, parallel=4, **more)
        return {event.host: event.outcome for event in events if isinstance(event, parallel_hosts.Finished)}

    with running(run_by["k3"].prefix, "k3", swarm="new", **IN_USE) as commands:
        refused = removed("leader")["leader"]
        assert isinstance(refused, HostError)
        assert refused.kind is Kind.BUSY
        assert "k3 on k3 is commanded by joystick (/joystick), and depends on swarm-new." in str(refused)
        assert removed("leader", stop_robots=True) == {"leader": Removed(True)}
        assert commands.held
    assert not (run_by["leader"].prefix / "opt/swarm/new").exists()
