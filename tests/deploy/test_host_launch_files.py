"""Launch files that lie on hosts only are checked before any host changes, by the rules for local ones."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from swarmctl.deploy.launch_files_on_hosts import launch_files_of
from swarmctl.deploy.outcome import Outcome
from swarmctl.deploy.rollout import observe
from swarmctl.health.checks import State
from swarmctl.health.diagnosis import diagnose
from swarmctl.health.expected_graph import Release, expected_graph
from swarmctl.health.observations import Answer, ConflictSeen
from swarmctl.plan.launch_findings import NOT_CHECKED
from swarmctl.plan.plan import Plan
from swarmctl.remote.agent_client import DirectConversation
from swarmctl.remote.transport import HostError, Kind
from swarmctl.rules.runner import load_checked
from swarmctl.spec.load import Document
from swarmctl.swarm.resolve import resolve
from tests.deploy.deploying import deploy
from tests.deploy.test_rollout import HOSTS, TARGETS, FolderTransport, bundles, deployed, hosts
from tests.health.swarm_values import RUNNING
from tests.packages.agent.fakehost import FakeHost
from tests.ros_packages.packages import manifest

__all__ = ["hosts"]  # the fixture
SPEC = """\
version: 1
name: new
mode: central
hub: leader
hosts:
  leader: {address: 192.0.2.1}
  k3: {address: 192.0.2.2}
  epuck: {address: 192.0.2.3}
robots:
  koala: {type: koala, host: leader}
links:
  - {kind: wlan, name: lab, hosts: [leader, k3, epuck]}
  - {kind: serial, host: leader, robot: koala, usb: {serial: A600dXyz}}
control:
  - {by: leader, of: [koala]}
programs:
"""
LEFT = "  left: {host: k3, package: talking, launch: eyes.launch%s}\n"
RIGHT = "  right: {host: epuck, package: talking, launch: eyes.launch}\n"
SHARE = "opt/ros/noetic/share"
EYES = '<launch><arg name="side" default="left"/><node pkg="talking" type="say" name="%s"/></launch>'


def document(folder: Path, programs: str) -> Document:
    spec = folder / "swarm.yaml"
    spec.write_text(SPEC + programs)
    found, diagnostics = load_checked(spec)
    assert found is not None, diagnostics
    return found


def put(host: FakeHost, **files: str) -> None:
    """Writes launch files, named ``PACKAGE__FILE``, and the packages around them."""
    for name, text in files.items():
        package, _, file = name.partition("__")
        folder = host.prefix / SHARE / package
        (folder / "launch").mkdir(parents=True, exist_ok=True)
        (folder / "package.xml").write_text(manifest(package))
        (folder / f"launch/{file}.launch").write_text(text)


def planned(hosts: Mapping[str, FakeHost], found: Document, parallel: int = 3) -> Plan:
    transport = FolderTransport(hosts, {})
    return observe(bundles(), TARGETS, transport, parallel=parallel, launch_files=launch_files_of(found))


def rollout(
    hosts: Mapping[str, FakeHost], found: Document, parallel: int = 3, most_failed: int | None = 0
) -> dict[str, Outcome | HostError]:
    events = deploy(
        bundles(), TARGETS, FolderTransport(hosts, {}), parallel=parallel, most_failed=most_failed,
        launch_files=launch_files_of(found),
    )  # fmt: skip
    return deployed(events)


def kinds(results: Mapping[str, Outcome | HostError]) -> dict[str, Kind | None]:
    return {host: one.kind if isinstance(one, HostError) else None for host, one in results.items()}


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder with the texts that were read."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache/swarmctl/launch"


@pytest.fixture
def answers(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The answers about launch files, as JSON; a test empties it between two looks."""
    found: list[str] = []
    ask = DirectConversation.ask

    def noted(self: DirectConversation, request: Any, *rest: Any, **more: Any) -> Any:
        answer = ask(self, request, *rest, **more)
        found.extend([json.dumps(answer)] if request["verb"] == "launch_files" else [])
        return answer

    monkeypatch.setattr(DirectConversation, "ask", noted)
    return found


def test_an_unchanged_text_is_sent_once(
    hosts: dict[str, FakeHost], tmp_path: Path, cache: Path, answers: list[str]
) -> None:
    spec = document(tmp_path, LEFT % ", args: {side: right}")
    text = f"<!-- {'long ' * 1000} -->" + EYES % "eyes"
    put(hosts["k3"], talking__eyes=text)

    def looked() -> tuple[int, bool]:
        answers.clear()
        bad = any(one.problem for one in planned(hosts, spec).hosts)
        return sum(map(len, answers)), bad

    first = looked()
    assert first[0] > len(text)
    again, bad = looked()
    assert (len(answers), bad) == (1, False)
    assert again < first[0] / 10
    [kept] = cache.iterdir()
    kept.write_text("<launch>")
    assert looked() == first
    put(hosts["k3"], talking__eyes=text.replace('"side"', '"sides"'))
    assert looked()[1]


def test_a_cache_that_cannot_be_written_costs_bytes_alone(
    hosts: dict[str, FakeHost], tmp_path: Path, cache: Path, answers: list[str]
) -> None:
    cache.parent.parent.mkdir()
    cache.parent.write_text("no folder")
    spec = document(tmp_path, LEFT % "")
    put(hosts["k3"], talking__eyes=EYES % "eyes")
    for _ in range(2):
        assert all(one.problem is None and not one.notes for one in planned(hosts, spec).hosts)
    assert len(answers) == 4


@pytest.mark.parametrize("parallel", [1, 3])
def test_an_unknown_argument_stops_every_host(
    parallel: int, hosts: dict[str, FakeHost], tmp_path: Path
) -> None:
    put(hosts["k3"], talking__eyes=EYES % "eyes")
    found = rollout(hosts, document(tmp_path, LEFT % ", args: {sides: both}"), parallel)
    assert kinds(found) == {"leader": Kind.HELD, "k3": Kind.UNFIT, "epuck": Kind.HELD}
    refused = found["k3"]
    assert isinstance(refused, HostError)
    assert refused.message.startswith(
        f"PKG005: the launch file of program `left` has no argument `sides` (k3:/{SHARE}/talking/launch/"
    )
    assert refused.message.endswith("swarm.yaml:17:66")
    assert "side" in refused.hint
    assert all(host.observe()["release"] is None for host in hosts.values())
    left_out = rollout(hosts, document(tmp_path, LEFT % ", args: {sides: both}"), parallel, most_failed=None)
    assert kinds(left_out) == {"leader": None, "k3": Kind.UNFIT, "epuck": None}


def test_files_without_faults_hold_nobody(hosts: dict[str, FakeHost], tmp_path: Path) -> None:
    for name, node in (("k3", "left"), ("epuck", "right")):
        put(hosts[name], talking__eyes=EYES % node)
    assert kinds(rollout(hosts, document(tmp_path, LEFT % "" + RIGHT))) == dict.fromkeys(HOSTS)


def test_equal_nodes_of_two_hosts_are_found_through_includes(
    hosts: dict[str, FakeHost], tmp_path: Path
) -> None:
    """The path of the second file has an argument, which only the evaluated file shows."""
    put(
        hosts["k3"],
        talking__eyes='<launch><arg name="base" default="a"/>'
        '<include file="$(find base)/launch/$(arg base).launch"/></launch>',
        base__a='<launch><include file="$(find base)/launch/b.launch"/></launch>',
        base__b='<launch>\n<node pkg="base" type="say" name="/eyes"/>\n</launch>',
    )
    put(hosts["epuck"], talking__eyes=EYES % "eyes")
    plan = planned(hosts, document(tmp_path, LEFT % "" + RIGHT))
    problems = {one.host: one.problem.message for one in plan.hosts if one.problem}
    assert problems.keys() == {"k3", "epuck"}
    for message in problems.values():
        assert message.startswith("PKG008")
        assert f"k3:/{SHARE}/base/launch/b.launch:2" in message
        assert f"epuck:/{SHARE}/talking/launch/eyes.launch:1" in message


def test_a_finding_on_hosts_can_be_suppressed(hosts: dict[str, FakeHost], tmp_path: Path) -> None:
    """`validate`, which reads no host, does not call the suppression unused."""
    for host in ("k3", "epuck"):
        put(hosts[host], talking__eyes=EYES % "eyes")
    silence = "silence: [{rule: PKG008, reason: only one of them runs at a time}]\n"
    found = document(tmp_path, LEFT % "" + RIGHT + silence)
    assert not [one for one in load_checked(tmp_path / "swarm.yaml")[1] if one.code == "SIL001"]
    assert all(one.problem is None for one in planned(hosts, found).hosts)


def test_a_missing_launch_file_is_an_error_with_what_is_there(
    hosts: dict[str, FakeHost], tmp_path: Path
) -> None:
    put(hosts["k3"], talking__eye="<launch/>", talking__words="<launch/>")
    problem = planned(hosts, document(tmp_path, LEFT % "")).hosts[1].problem
    assert problem is not None
    assert f"PKG003: package `talking` (k3:/{SHARE}/talking) has no launch file" in problem.message
    assert "`eye.launch`" in problem.hint


def test_a_warning_is_a_note_and_holds_nobody(hosts: dict[str, FakeHost], tmp_path: Path) -> None:
    put(
        hosts["k3"],
        talking__eyes='<launch><node pkg="away" type="say" name="a"/>'
        '<node pkg="there" type="say" name="b"/></launch>',
        there__x="<launch/>",
    )
    plan = planned(hosts, document(tmp_path, LEFT % "")).hosts[1]
    assert plan.problem is None
    (note,) = plan.notes
    assert note.startswith("PKG009: the launch file of program `left` uses undeclared packages: `away` (k3:/")


def test_a_host_fills_no_screen_with_packages(hosts: dict[str, FakeHost], tmp_path: Path) -> None:
    nodes = (f'<node pkg="p{number}" type="t" name="n{number}"/>' for number in range(500))
    put(hosts["k3"], talking__eyes=f"<launch>{''.join(nodes)}</launch>")
    (note,) = planned(hosts, document(tmp_path, LEFT % "")).hosts[1].notes
    assert "`p0`, `p1`" in note
    assert "`p19` and 480 more" in note
    assert len(note) < 1000


def test_too_many_files_are_not_checked_and_that_is_noted(hosts: dict[str, FakeHost], tmp_path: Path) -> None:
    chain = {
        f"talking__{number}": f'<launch><include file="$(find talking)/launch/{number + 1}.launch"/></launch>'
        for number in range(30)
    }
    put(
        hosts["k3"],
        talking__eyes='<launch><include file="$(find talking)/launch/0.launch"/></launch>',
        **chain,
    )
    plan = planned(hosts, document(tmp_path, LEFT % ", args: {sides: both}")).hosts[1]
    assert plan.problem is None
    assert plan.notes == (NOT_CHECKED,)


def test_status_reports_an_error_of_a_launch_file(hosts: dict[str, FakeHost], tmp_path: Path) -> None:
    put(hosts["k3"], talking__eyes="<launch>\n<node/></launch>")
    found = document(tmp_path, LEFT % "")
    launch_files = launch_files_of(found)
    assert launch_files is not None
    for _ in range(2):  # as --watch, which reads them once
        observe(bundles(), TARGETS, FolderTransport(hosts, {}), launch_files=launch_files)
        (hosts["k3"].prefix / SHARE / "talking/launch/eyes.launch").write_text("<launch/>")
    swarm = resolve(found)
    graph = expected_graph(swarm, {name: Release("a", ()) for name in HOSTS})
    answers = {name: Answer(release="a") for name in HOSTS}
    cause = diagnose(graph, answers, launch_files.findings()).findings
    (fault,) = (one for one in cause if one.check == "launch files")
    assert (fault.host, fault.state) == ("k3", State.BAD)
    assert f"k3:/{SHARE}/talking/launch/eyes.launch:2" in fault.message


@pytest.mark.parametrize(("active", "state"), [("active", State.BAD), ("inactive", State.WARNING)])
def test_status_knows_the_nodes_of_a_unit_that_is_only_starting(
    active: str, state: State, hosts: dict[str, FakeHost], tmp_path: Path
) -> None:
    """The probe of one host saw its node end, that of the other found no node yet."""
    for host in ("k3", "epuck"):
        put(hosts[host], talking__eyes=EYES % "eyes")
    silence = "silence: [{rule: PKG008, reason: the test looks at what happens then}]\n"
    found = document(tmp_path, LEFT % "" + RIGHT + silence)
    launch_files = launch_files_of(found)
    assert launch_files is not None
    observe(bundles(), TARGETS, FolderTransport(hosts, {}), launch_files=launch_files)
    left, right = "swarm-new.left.service", "swarm-new.right.service"
    units = {"leader": (), "k3": (left,), "epuck": (right,)}
    graph = expected_graph(resolve(found), {name: Release("a", units[name]) for name in HOSTS})
    answers = {name: Answer(release="a") for name in HOSTS}
    answers["k3"] = replace(answers["k3"], units={left: replace(RUNNING, active=active)})
    kicked = {right: {"/eyes": ConflictSeen(1, 2.0)}}
    answers["epuck"] = replace(answers["epuck"], units={right: RUNNING}, conflicts=kicked)
    seen = diagnose(graph, answers, {}, launch_files.nodes()).findings
    (name,) = (one for one in seen if one.check == "node name")
    assert name.state is state
    assert ("two nodes are called /eyes, on hosts k3 and epuck" in name.message) == (state is State.BAD)


def test_a_package_that_a_host_lacks_is_no_fault_of_its_files(
    hosts: dict[str, FakeHost], tmp_path: Path
) -> None:
    assert all(one.problem is None for one in planned(hosts, document(tmp_path, LEFT % "")).hosts)


def test_packages_beside_the_spec_are_not_read_on_hosts(tmp_path: Path) -> None:
    beside = tmp_path / "talking"
    (beside / "launch").mkdir(parents=True)
    (beside / "package.xml").write_text(manifest("talking"))
    (beside / "launch/eyes.launch").write_text("<launch/>")
    assert launch_files_of(document(tmp_path, LEFT % "")) is None
