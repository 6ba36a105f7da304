"""``swarmctl status``: what it prints where, and what its exit code says."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator, ValidationError
from lxml import etree
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.cli.where import Where
from swarmctl.health import collect as asking
from swarmctl.health.expected_graph import ExpectedGraph, ExpectedHost
from swarmctl.health.swarm_health import status_schema
from swarmctl.lab import lab
from swarmctl.remote.transport import HostError, Kind, Target
from tests.health.swarm_values import K3_PI, all_well, graph, nothing_deployed, with_device

SCHEMA = Draft202012Validator(status_schema())
JUNIT = etree.XMLSchema(file=str(Path(__file__).parent.parent / "views/schemas/junit-10.xsd"))
AWAY = HostError(Kind.UNREACHABLE, "connect timed out")


def spoilt() -> dict[str, Any]:
    answers = all_well()
    return {**answers, K3_PI: with_device("k3", exists=False)(answers[K3_PI])}


class Hosts:
    """Stands for the hosts: what they answer round by round, then Ctrl-C; and which were probed."""

    def __init__(self) -> None:
        self.rounds: list[dict[str, Any]] = []
        self.probed: list[tuple[str, ...]] = []
        self.releases: dict[str, str] = {}  # others than that of the spec

    def ask(self, shown: ExpectedGraph, *_: Any, **__: Any) -> dict[str, Any]:
        self.probed.append(tuple(host.name for host in shown.hosts))
        if not self.rounds:
            raise KeyboardInterrupt
        answers = self.rounds.pop(0)
        return {host.name: self._deployed(answers[host.name], host) for host in shown.hosts}

    def _deployed(self, answer: Answer | HostError, host: ExpectedHost) -> Answer | HostError:
        release = self.releases.get(host.name, host.release.digest)
        return answer if isinstance(answer, HostError) else answer._replace(release=release)


@pytest.fixture
def hosts(monkeypatch: pytest.MonkeyPatch) -> Hosts:
    found = Hosts()
    monkeypatch.setattr(asking, "probe_hosts", found.ask)
    reach = {host.name: Target(host.name, host.address, "robot") for host in graph().hosts}
    monkeypatch.setattr(Where, "targets", lambda *_, **__: reach)
    return found


CASES = {
    "healthy": (all_well, exit_codes.OK),
    "unhealthy": (spoilt, exit_codes.UNHEALTHY),
    "unreachable": (lambda: {**all_well(), K3_PI: AWAY}, exit_codes.HOSTS_UNREACHABLE),
    "unreachable and unhealthy": (lambda: {**spoilt(), "epuck-pi": AWAY}, exit_codes.UNHEALTHY),
    "a wrong key": (lambda: {**all_well(), K3_PI: HostError(Kind.HOST_KEY, "wrong")}, exit_codes.UNHEALTHY),
}


@pytest.mark.parametrize(("answers", "code"), CASES.values(), ids=CASES.keys())
def test_the_exit_code_says_how_it_is(hosts: Hosts, leader_spec: Path, answers: Any, code: int) -> None:
    hosts.rounds = [answers()]
    assert run(["status", str(leader_spec)]) == code


def test_wait_repeats_until_the_swarm_is_healthy(
    hosts: Hosts, leader_spec: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("swarmctl.cli.verbs.status._AGAIN", 0.01)
    hosts.rounds = [{**all_well(), K3_PI: AWAY}, spoilt(), spoilt(), all_well(), spoilt()]
    assert run(["status", str(leader_spec), "--wait"]) == exit_codes.OK
    printed = capsys.readouterr()
    assert [line.partition(",")[0] for line in printed.err.splitlines() if line.startswith("waiting")] == [
        "waiting: host k3-pi: connect timed out",
        "waiting: device k3: /dev/swarm/k3 does not exist",
    ]
    assert "newswarm is healthy" in printed.out
    assert len(hosts.rounds) == 1


def test_wait_ends_with_the_last_state_when_the_time_is_up(
    hosts: Hosts, leader_spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hosts.rounds = [spoilt()] * 9
    assert run(["status", str(leader_spec), "--wait", "--timeout", "1"]) == exit_codes.UNHEALTHY
    printed = capsys.readouterr()
    assert "not healthy within 1 s" in printed.err
    assert "/dev/swarm/k3 does not exist" in printed.out


def test_wait_for_hosts_leaves_their_health_aside(hosts: Hosts, leader_spec: Path) -> None:
    hosts.rounds = [{**spoilt(), "epuck-pi": AWAY}, spoilt()]
    assert run(["status", str(leader_spec), "--wait", "--for", "reachable"]) == exit_codes.OK
    assert not hosts.rounds


@pytest.mark.parametrize("more", [[], ["--lab"]])
def test_in_a_lab_it_names_the_robots_of_stand_ins(
    hosts: Hosts,
    leader_spec: Path,
    more: list[str],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    text = "robot k3: a stand-in moves and publishes in place of kobuki_node"
    monkeypatch.setattr(lab, "stand_ins", lambda _: (text,))
    hosts.rounds = [all_well()]
    assert run(["status", str(leader_spec), *more]) == exit_codes.OK
    assert (text in capsys.readouterr().out) is bool(more)


def test_watch_and_wait_exclude_each_other(hosts: Hosts, leader_spec: Path) -> None:
    assert run(["status", str(leader_spec), "--wait", "--watch"]) == exit_codes.USAGE
    assert run(["status", str(leader_spec), "--junit", "x.xml", "--watch"]) == exit_codes.USAGE
    assert not hosts.probed


def test_a_junit_file_that_cannot_be_written_costs_no_status(
    hosts: Hosts, leader_spec: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hosts.rounds = [spoilt()]
    assert run(["status", str(leader_spec), "--junit", str(tmp_path / "no/x.xml")]) == exit_codes.ERROR
    shown = capsys.readouterr()
    assert "/dev/swarm/k3 does not exist" in shown.out
    assert "cannot write" in shown.err


@pytest.mark.parametrize("answers", [one for one, _ in CASES.values()], ids=CASES.keys())
def test_json_fits_its_schema_and_junit_fails_for_each_trouble(
    hosts: Hosts, leader_spec: Path, tmp_path: Path, answers: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    hosts.rounds = [answers()]
    run(["status", str(leader_spec), "--json", "--junit", str(tmp_path / "status.xml")])
    report = json.loads(capsys.readouterr().out)
    SCHEMA.validate(report)
    with pytest.raises(ValidationError):
        SCHEMA.validate({**report, "hosts": [{**report["hosts"][0], "state": "fine"}]})
    findings = report["findings"]
    root = etree.parse(tmp_path / "status.xml").getroot()
    JUNIT.assertValid(root)
    results = {
        f"{case.get('classname').rpartition('.')[2]} {case.get('name')}": [one.tag for one in case]
        for case in root.iter("testcase")
    }
    assert results.keys() == {one["key"] for one in findings}
    for one in findings:
        fails = one["state"] == "bad" or (one["state"] == "unknown" and one["cause"] is None)
        assert (results[one["key"]] == ["failure"]) is fails, one
        assert bool(results[one["key"]]) is (one["state"] != "ok"), one
    assert root.get("failures") == str(sum(one == ["failure"] for one in results.values()))


def test_json_is_one_document(hosts: Hosts, leader_spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    hosts.rounds = [spoilt()]
    assert run(["status", str(leader_spec), "--json"]) == exit_codes.UNHEALTHY
    document = json.loads(capsys.readouterr().out)
    assert document["healthy"] is False
    assert {one["key"] for one in document["findings"] if one["state"] == "bad"} == {"device k3"}


def test_a_limit_asks_no_other_host(hosts: Hosts, leader_spec: Path) -> None:
    hosts.rounds = [all_well()]
    assert run(["status", str(leader_spec), "--limit", K3_PI]) == exit_codes.OK
    assert hosts.probed == [(K3_PI,)]


def test_watching_prints_a_line_of_json_a_round(
    hosts: Hosts, leader_spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hosts.rounds = [all_well(), spoilt()]
    assert run(["status", str(leader_spec), "--watch", "--every", "1", "--json"]) == exit_codes.OK
    assert [json.loads(line)["healthy"] for line in capsys.readouterr().out.splitlines()] == [True, False]


def test_watching_prints_a_block_a_round(
    hosts: Hosts, leader_spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hosts.rounds = [all_well(), spoilt()]
    assert run(["status", str(leader_spec), "--watch", "--every", "1"]) == exit_codes.OK
    assert capsys.readouterr().out.count("HOST / ROBOT") == 2


def test_rounds_come_no_closer_than_a_second(hosts: Hosts, leader_spec: Path) -> None:
    assert run(["status", str(leader_spec), "--watch", "--every", "0.1"]) == exit_codes.USAGE
    assert hosts.probed == []


def test_a_host_without_a_release_names_the_deploy_to_run(
    hosts: Hosts, leader_spec: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    answers = all_well()
    bare = {K3_PI: nothing_deployed(answers[K3_PI])}
    monkeypatch.setattr(asking, "probe_hosts", lambda *_, **__: bare)
    assert run(["status", str(leader_spec), "--limit", K3_PI]) == exit_codes.UNHEALTHY
    shown = capsys.readouterr().out
    assert f"nothing is deployed\n    help: run swarmctl deploy {leader_spec} --limit {K3_PI}\n" in shown
    assert run(["status", str(leader_spec), "--limit", K3_PI, "--json"]) == exit_codes.UNHEALTHY
    document = json.loads(capsys.readouterr().out)
    assert [host["deployed"] for host in document["hosts"]] == [False]
    assert {one["cause"] for one in document["findings"] if one["state"] == "bad"} == {
        None,
        f"release {K3_PI}",
    }


def test_hosts_that_have_not_the_release_of_the_spec_are_named(
    hosts: Hosts, leader_spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As after an operator was killed between two confirmations."""
    hosts.rounds, hosts.releases = [all_well()], {K3_PI: "b" * 16}
    run(["status", str(leader_spec), "--json"])
    report = json.loads(capsys.readouterr().out)
    SCHEMA.validate(report)
    with pytest.raises(ValidationError):
        SCHEMA.validate({**report, "hosts": [{**report["hosts"][0], "state": "fine"}]})
    findings = report["findings"]
    found = {one["host"]: one for one in findings if one["check"] == "release"}
    assert {host for host, one in found.items() if one["state"] != "ok"} == {K3_PI}
    assert found[K3_PI]["message"].startswith(f"runs {'b' * 16}, the spec renders ")
    assert found[K3_PI]["hint"] == "run swarmctl deploy"
