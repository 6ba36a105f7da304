"""What a rollout promises: every host ends in its own result, and a host that fails costs only itself.

The hosts are folders, and the real agent works on them; only the way there is short.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from swarm_onboard.agent.steps import Kind as Do

from swarmctl.deploy import journal
from swarmctl.deploy.outcome import WAITS, Outcome
from swarmctl.deploy.rollout import observe
from swarmctl.remote import agent_client, parallel_hosts
from swarmctl.remote.transport import HostError, Kind, Session, Target
from swarmctl.render.bundle import Bundle, File, Unit, package
from tests.deploy.deploying import deploy
from tests.onboard.agent.fakehost import FakeHost
from tests.onboard.agent.local_session import LocalSession

HOSTS = ("leader", "k3", "epuck")


@dataclass
class FolderTransport:
    """Leads to the folders; ``broken`` names what happens on the way instead."""

    hosts: Mapping[str, FakeHost]
    broken: Mapping[str, Exception]

    @contextmanager
    def connect(self, target: Target) -> Iterator[Session]:
        if target.host in self.broken:
            raise self.broken[target.host]
        yield LocalSession(self.hosts[target.host].environment())


@pytest.fixture
def hosts(tmp_path: Path) -> dict[str, FakeHost]:
    return hosts_in(tmp_path, HOSTS)


def hosts_in(folder: Path, names: Iterable[str]) -> dict[str, FakeHost]:
    """New hosts, whose agents may use sudo."""
    made = {name: FakeHost(folder / name) for name in names}
    for host in made.values():
        sudo = host.prefix / "bin/sudo"
        sudo.write_text('#!/bin/sh\nshift\nexec "$@"\n')
        sudo.chmod(0o755)
    return made


def bundles(**params: str) -> dict[str, Bundle]:
    """A release a host: one unit that reads one parameter file."""

    def one(name: str) -> Bundle:
        unit = File("units/new.robot.service", b"[Service]\nExecStart=/bin/true\n")
        text = File("params/robot.yaml", params.get(name, "speed: 1\n").encode(), origin=f"robots.{name}")
        return Bundle(
            (unit, text),
            (Unit("new.robot.service", (unit.path, text.path)),),
            {"/etc/systemd/system/new.robot.service": unit.path},
            swarm="new",
            host=name,
        )

    return {name: one(name) for name in HOSTS}


TARGETS = {name: Target(name, "192.0.2.1", "robot") for name in HOSTS}


def rollout(
    hosts: Mapping[str, FakeHost], wanted: Mapping[str, Bundle], **broken: Exception
) -> dict[str, Outcome | HostError]:
    return deployed(deploy(wanted, TARGETS, FolderTransport(hosts, broken), parallel=3))


def deployed(events: Iterator[parallel_hosts.Event[Outcome]]) -> dict[str, Outcome | HostError]:
    return {event.host: event.outcome for event in events if isinstance(event, parallel_hosts.Finished)}


def changed(results: Mapping[str, Outcome | HostError]) -> dict[str, bool | Kind]:
    return {name: one.kind if isinstance(one, HostError) else one.changed for name, one in results.items()}


def test_every_host_gets_its_release_and_a_second_run_is_idle(hosts: dict[str, FakeHost]) -> None:
    assert changed(rollout(hosts, bundles())) == dict.fromkeys(HOSTS, True)
    for name, host in hosts.items():
        assert host.read("opt/swarm/new/current/params/robot.yaml") == b"speed: 1\n", name
    for host in hosts.values():
        host.calls()
    assert changed(rollout(hosts, bundles())) == dict.fromkeys(HOSTS, False)
    assert [host.calls() for host in hosts.values()] == [[], [], []]


def test_a_changed_parameter_touches_its_host_only(hosts: dict[str, FakeHost]) -> None:
    rollout(hosts, bundles())
    results = rollout(hosts, bundles(k3="speed: 2\n"))
    assert changed(results) == {"leader": False, "k3": True, "epuck": False}
    k3 = results["k3"]
    assert isinstance(k3, Outcome)
    assert k3.plan.targets(Do.RESTART) == ("new.robot.service",)


@pytest.mark.parametrize(
    ("error", "kind"),
    [
        (HostError(Kind.UNREACHABLE, "no route to k3"), Kind.UNREACHABLE),
        (HostError(Kind.LOST, "k3 went away"), Kind.LOST),
        (ZeroDivisionError("a bug"), Kind.BUG),
    ],
)
def test_a_host_that_fails_costs_only_itself(
    hosts: dict[str, FakeHost], error: Exception, kind: Kind
) -> None:
    results = rollout(hosts, bundles(), k3=error)
    assert changed(results) == {"leader": True, "k3": kind, "epuck": True}
    assert changed(rollout(hosts, bundles())) == {"leader": False, "k3": True, "epuck": False}


def test_a_host_whose_unit_does_not_start_keeps_its_old_release(hosts: dict[str, FakeHost]) -> None:
    old, new = bundles(), bundles(k3="speed: 2\n")
    rollout(hosts, old)
    (hosts["k3"].prefix / f"broken-new.robot.service-{new['k3'].digest}").touch()
    results = rollout(hosts, new)
    assert changed(results)["k3"] is Kind.FAILED
    assert old["k3"].digest in str(results["k3"])
    assert hosts["k3"].read("opt/swarm/new/current/params/robot.yaml") == b"speed: 1\n"


def test_a_plan_changes_nothing_and_lists_unreachable_hosts(
    hosts: dict[str, FakeHost],
) -> None:
    away = FolderTransport(hosts, {"k3": HostError(Kind.UNREACHABLE, "no route to k3", "is it on?")})
    plan = observe(bundles(), TARGETS, away, parallel=4)
    assert [host.host for host in plan.hosts] == list(HOSTS)
    assert plan.changes
    assert [host.host for host in plan.problems] == ["k3"]
    assert not any((host.prefix / "opt/swarm/new/current").exists() for host in hosts.values())


def test_the_journal_gives_back_what_was_deployed(tmp_path: Path) -> None:
    bundle = bundles()["k3"]
    journal.remember(tmp_path / "new", "k3", bundle.digest, bundle.manifest)
    assert journal.recall(tmp_path / "new", "k3").digest == bundle.digest
    assert journal.recall(tmp_path / "new", "k3").manifest == bundle.manifest


@pytest.mark.parametrize("text", ["", "{", "[]", '{"digest": 1}', '{"manifest": 3, "digest": "x"}'])
def test_a_damaged_journal_is_an_empty_one(tmp_path: Path, text: str) -> None:
    (tmp_path / "k3.json").write_text(text)
    assert journal.recall(tmp_path, "k3").digest is None


def test_the_journal_knows_the_hosts_that_the_spec_has_dropped(tmp_path: Path) -> None:
    for name in HOSTS:
        journal.remember(tmp_path, name, "0" * 16, {})
    assert journal.left(tmp_path, HOSTS) == []
    assert journal.left(tmp_path, ["leader"]) == ["epuck", "k3"]
    journal.forget(tmp_path, "k3")
    assert journal.left(tmp_path, ["leader"]) == ["epuck"]
    assert journal.left(tmp_path / "never", HOSTS) == []


def test_the_journal_knows_the_hosts_that_failed(tmp_path: Path) -> None:
    assert journal.failed(tmp_path / "new", lab=False) == []
    journal.remember_failed(tmp_path / "new", ["k3", "epuck"], lab=False)
    assert journal.failed(tmp_path / "new", lab=False) == ["epuck", "k3"]
    assert journal.failed(tmp_path / "new", lab=True) == []
    assert journal.left(tmp_path / "new", ()) == []
    (tmp_path / "new/.failed").write_text("{")
    assert journal.failed(tmp_path / "new", lab=False) == []


@pytest.mark.parametrize("parallel", [1, 3])
def test_an_unfit_host_stops_all_before_any_change(hosts: dict[str, FakeHost], parallel: int) -> None:
    wanted = {**bundles(), "k3": replace(bundles()["k3"], requires={package("rare"): ()})}
    away = FolderTransport(hosts, {"epuck": HostError(Kind.UNREACHABLE, "no route")})
    some = deploy(wanted, TARGETS, away, parallel=parallel, most_failed=0, optional=("epuck",))
    found = changed(deployed(some))
    assert found == {"leader": Kind.HELD, "k3": Kind.UNFIT, "epuck": Kind.UNREACHABLE}
    assert not (hosts["leader"].prefix / "opt/swarm/new").exists()

    some = deploy(wanted, TARGETS, away, parallel=parallel, most_failed=0, optional=("k3", "epuck"))
    assert changed(deployed(some)) == {"leader": True, "k3": Kind.UNFIT, "epuck": Kind.UNREACHABLE}


def test_a_host_that_is_away_holds_the_others_back(hosts: dict[str, FakeHost]) -> None:
    away = FolderTransport(hosts, {"k3": HostError(Kind.UNREACHABLE, "no route")})
    results = deployed(deploy(bundles(), TARGETS, away, most_failed=0))
    assert changed(results) == {"leader": Kind.HELD, "k3": Kind.UNREACHABLE, "epuck": Kind.HELD}
    assert str(results["leader"]) == "nothing was changed, since k3 does not answer"

    found = changed(deployed(deploy(bundles(), TARGETS, away, most_failed=1)))
    assert found == {"leader": True, "k3": Kind.UNREACHABLE, "epuck": True}


def test_a_host_that_is_away_is_left_out_unless_all_change_together(hosts: dict[str, FakeHost]) -> None:
    away = FolderTransport(hosts, {"k3": HostError(Kind.UNREACHABLE, "no route")})
    apart = {"most_failed": 0, "apart": (Kind.UNREACHABLE,)}
    found = changed(deployed(deploy(bundles(), TARGETS, away, consistency="all", **apart)))
    assert found == {"leader": Kind.HELD, "k3": Kind.UNREACHABLE, "epuck": Kind.HELD}
    found = changed(deployed(deploy(bundles(), TARGETS, away, **apart)))
    assert found == {"leader": True, "k3": Kind.UNREACHABLE, "epuck": True}

    lost = FolderTransport(hosts, {"k3": HostError(Kind.AUTH, "no key was accepted")})
    found = changed(deployed(deploy(bundles(leader="speed: 2"), TARGETS, lost, **apart)))
    assert found == {"leader": Kind.HELD, "k3": Kind.AUTH, "epuck": False}


def test_a_release_that_was_chosen_later_stays(hosts: dict[str, FakeHost]) -> None:
    way, later = FolderTransport(hosts, {}), bundles(k3="speed: 2")
    deployed(deploy(later, TARGETS, way, issued=200.0))
    found = deployed(deploy(bundles(k3="speed: 1"), TARGETS, way, most_failed=0, issued=100.0))
    assert changed(found) == {"leader": False, "k3": Kind.NEWER, "epuck": False}
    assert str(found["k3"]).startswith(f"release {later['k3'].digest} was deployed later, by ")
    assert hosts["k3"].read("opt/swarm/new/current/params/robot.yaml") == b"speed: 2"

    found = deployed(deploy(bundles(k3="speed: 3"), TARGETS, way, issued=300.0))
    assert changed(found) == {"leader": False, "k3": True, "epuck": False}


def test_a_failed_release_leaves_the_one_before_the_newest(hosts: dict[str, FakeHost]) -> None:
    way, broken = FolderTransport(hosts, {}), bundles(k3="speed: 9")
    deployed(deploy(bundles(k3="speed: 2"), TARGETS, way, issued=200.0))
    (hosts["k3"].prefix / f"broken-new.robot.service-{broken['k3'].digest}").touch()
    assert changed(deployed(deploy(broken, TARGETS, way, issued=300.0)))["k3"] is Kind.FAILED
    assert changed(deployed(deploy(bundles(k3="speed: 1"), TARGETS, way, issued=100.0)))["k3"] is Kind.NEWER
    assert changed(deployed(deploy(bundles(k3="speed: 3"), TARGETS, way, issued=250.0)))["k3"] is True


@pytest.mark.parametrize("seed", range(3))
def test_whatever_hosts_come_and_go_all_end_at_the_newest_release(
    hosts: dict[str, FakeHost], seed: int
) -> None:
    """Of two operators, who deploy now and then, and whose `--when-seen` goes on."""
    chance = random.Random(seed)
    chosen: dict[str, tuple[float, str]] = {}
    for step in range(1, 9):
        who = chance.choice(("anna", "ben"))
        if who not in chosen or chance.random() < 0.5:
            chosen[who] = float(step), f"speed: {step}"
        away = dict.fromkeys(chance.sample(HOSTS, chance.randint(0, 3)), HostError(Kind.UNREACHABLE, "off"))
        _when_seen(FolderTransport(hosts, away), *chosen[who])
    for one in (*chosen.values(), *chosen.values()):
        _when_seen(FolderTransport(hosts, {}), *one)
    content = {host.read("opt/swarm/new/current/params/robot.yaml").decode() for host in hosts.values()}
    assert content == {max(chosen.values())[1]}


def _when_seen(way: FolderTransport, issued: float, content: str) -> None:
    wanted = bundles(**dict.fromkeys(HOSTS, content))
    deployed(deploy(wanted, TARGETS, way, most_failed=0, apart=WAITS, issued=issued))


def test_only_what_changed_travels(hosts: dict[str, FakeHost], monkeypatch: pytest.MonkeyPatch) -> None:
    sent: list[list[str]] = []
    pack = agent_client.pack

    def recorded(manifest: bytes, files: Mapping[str, tuple[bytes, int]]) -> bytes:
        sent.append(sorted(files))
        return pack(manifest, files)

    rollout(hosts, bundles())
    monkeypatch.setattr(agent_client, "pack", recorded)
    rollout(hosts, bundles(k3="speed: 2\n"))
    assert sent == [["params/robot.yaml"]]
    assert hosts["k3"].read("opt/swarm/new/current/params/robot.yaml") == b"speed: 2\n"

    (hosts["k3"].prefix / "opt/swarm/new/current/units/new.robot.service").write_text("edited")
    again = bundles(k3="speed: 2\n")
    way = FolderTransport(hosts, {})
    assert changed(deployed(deploy(again, TARGETS, way, overwrite_edits=True)))["k3"] is True
    assert sent[1:] == [["units/new.robot.service"]]
