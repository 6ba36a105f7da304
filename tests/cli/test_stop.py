"""``swarmctl stop`` and ``start`` as a person and a script see them; the hosts' answers are invented."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from swarm_onboard.agent.robot_motion import RobotMotion
from swarm_onboard.agent.verbs import restart as restart_verb
from swarm_onboard.agent.verbs import start as start_verb
from swarm_onboard.agent.verbs import stop as stop_verb

from swarmctl.cli import exit_codes
from swarmctl.deploy import robot_stop
from swarmctl.deploy.robot_stop import HostStop
from swarmctl.remote.parallel_hosts import Finished
from swarmctl.remote.transport import HostError, Kind
from tests.in_process import swarmctl

SPEC = """\
version: 1
name: lab
hosts:
  one: {address: 10.0.0.1}
  two: {address: 10.0.0.2}
robots:
  r1: {type: unknown-type, host: one}
  r2: {type: koala, host: one}
  r3: {type: koala, host: two}
"""
STANDS = RobotMotion(True, True, "wheels", 0.2, "joy (/joy)", "")
STOOD = STANDS._replace(seconds=0.0, commander="nobody")
SENT = STANDS._replace(proof="sent", commander="nobody", trouble="its wheels are not measured")
UNGUARDED = STANDS._replace(latched=False, proof="none", trouble="nothing stops its wheels")
AWAY = HostError(Kind.UNREACHABLE, "no route to host")
LOST = HostError(Kind.LOST, "the connection was lost")
BUSY = HostError(Kind.REFUSED, "r3 is commanded by joy", "use --stop-robots")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "swarm.yaml").write_text(SPEC)
    return tmp_path


def of(found: dict[str, Any], robots: list[str]) -> HostStop:
    chosen = {name: found[name] for name in robots}
    return HostStop(stop_verb.Answer(True, 0.3, chosen), 1.0)


def answers(monkeypatch: pytest.MonkeyPatch, one: Any, two: Any) -> list[dict[str, Any]]:
    """Hosts give these answers; returns what they were sent."""
    sent: list[dict[str, Any]] = []

    def stop(_: str, robots: dict[str, list[str]], *__: Any, **options: Any) -> Iterator[Finished[Any]]:
        sent.append({"robots": robots, **options})
        for host, found in {"one": one, "two": two}.items():
            if host in robots:
                yield Finished(host, found if isinstance(found, HostError) else of(found, robots[host]), 1.0)

    monkeypatch.setattr(robot_stop, "stop", stop)
    return sent


@pytest.mark.parametrize(
    ("two", "code", "line"),
    [
        ({"r3": STANDS}, exit_codes.OK, "r3  stands: by its wheels, 0.90 s after the command; was c"),
        (
            {"r3": STANDS._replace(proof="odometry")},
            exit_codes.OK,
            "r3  stands: by its odometry, 0.90 s after",
        ),
        ({"r3": STOOD}, exit_codes.OK, "r3  stands: stood already"),
        ({"r3": SENT}, exit_codes.NOT_PROVEN, "r3  not proven: a zero was sent, at most 0.90 s"),
        ({"r3": UNGUARDED}, exit_codes.HOSTS_FAILED, "r3  NOT STOPPED: two: nothing stops its wheels"),
        (AWAY, exit_codes.HOSTS_UNREACHABLE, "r3  NOT STOPPED: two: no route to host"),
        (LOST, exit_codes.HOSTS_FAILED, "r3  not known to stand: two: the connection was lost"),
    ],
)  # fmt: skip
def test_each_robot_has_its_line_and_its_exit_code(
    folder: Path, monkeypatch: pytest.MonkeyPatch, two: Any, code: int, line: str
) -> None:
    answers(monkeypatch, {"r1": STANDS, "r2": STANDS}, two)
    found = swarmctl("stop", "swarm.yaml", cwd=folder)
    assert found.returncode == code, found.stderr
    assert line in found.stdout
    assert "r1  stands: " in found.stdout  # whatever became of the other host
    state = "stands" if code == exit_codes.OK else "unproven" if code == exit_codes.NOT_PROVEN else "failed"
    document = json.loads(swarmctl("stop", "swarm.yaml", "--json", cwd=folder).stdout)
    assert {one["robot"]: one["state"] for one in document["robots"]} == {
        "r1": "stands", "r2": "stands", "r3": state
    }  # fmt: skip


def test_a_selection_stops_no_other_robot(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sent = answers(monkeypatch, {"r1": STANDS, "r2": STANDS}, {"r3": STANDS})
    assert swarmctl("stop", "swarm.yaml", "r2", cwd=folder).returncode == exit_codes.OK
    assert swarmctl("stop", "r2", cwd=folder).returncode == exit_codes.OK
    assert swarmctl("stop", cwd=folder).returncode == exit_codes.OK
    assert [(one["robots"], one["others"]) for one in sent] == [
        ({"one": ["r2"]}, False),
        ({"one": ["r2"]}, False),
        ({"one": ["r1", "r2"], "two": ["r3"]}, True),
    ]


def test_a_robot_without_a_host_is_named(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    answers(monkeypatch, {"r1": STANDS, "r2": STANDS}, {"r3": STANDS})
    (folder / "swarm.yaml").write_text(SPEC.replace("host: two", "host: gone"))
    found = swarmctl("stop", cwd=folder)
    assert found.returncode == exit_codes.HOSTS_FAILED
    assert "r3  NOT STOPPED: the spec has no host with an address for it" in found.stdout
    assert "2 of 3 robots stand" in found.stdout
    assert "swarm.yaml has 3 errors, and what could be read of it was used; `swarmctl validate` shows" in (
        found.stderr
    )
    assert "3 errors" in swarmctl("validate", cwd=folder).stderr


@pytest.mark.parametrize(
    ("two", "code"),
    [
        (start_verb.Answer(deployed=True, released=["r3"]), exit_codes.OK),
        (AWAY, exit_codes.HOSTS_UNREACHABLE),
        (LOST, exit_codes.HOSTS_FAILED),
    ],
)
def test_start_names_what_it_released_and_what_failed(
    folder: Path, monkeypatch: pytest.MonkeyPatch, two: Any, code: int
) -> None:
    def start(*_: Any, **__: Any) -> Iterator[Finished[Any]]:
        yield Finished("one", start_verb.Answer(deployed=True, released=["r1"]), 1.0)
        yield Finished("two", two, 1.0)

    monkeypatch.setattr(robot_stop, "start", start)
    found = swarmctl("start", cwd=folder)
    assert found.returncode == code
    assert "r1  released" in found.stdout
    assert ("two  " in found.stdout) == isinstance(two, HostError)
    document = json.loads(swarmctl("start", "--json", cwd=folder).stdout)
    assert [one["host"] for one in document["errors"]] == (["two"] if isinstance(two, HostError) else [])


@pytest.mark.parametrize(
    ("two", "code", "line"),
    [
        (["r3.service"], exit_codes.OK, "two  restarted r3.service"),
        ([], exit_codes.OK, "two  nothing to restart"),
        (AWAY, exit_codes.HOSTS_UNREACHABLE, "two  unreachable: no route to host"),
        (BUSY, exit_codes.HOSTS_FAILED, "two  refused: r3 is commanded by joy"),
    ],
)
def test_restart_prints_the_units_of_each_host(
    folder: Path, monkeypatch: pytest.MonkeyPatch, two: Any, code: int, line: str
) -> None:
    def restart(_: str, robots: dict[str, list[str]], *__: Any, **options: Any) -> Iterator[Finished[Any]]:
        assert options["stop_robots"] is False
        for host, units in {"one": ["r1.service"], "two": two}.items():
            answer = restart_verb.Answer(deployed=True, restarted=units)
            yield Finished(host, units if isinstance(units, HostError) else answer, 1.0)

    monkeypatch.setattr(robot_stop, "restart", restart)
    found = swarmctl("restart", "swarm.yaml", cwd=folder)
    assert (found.returncode, line in found.stdout) == (code, True), found.stdout + found.stderr
    assert "one  restarted r1.service" in found.stdout
    document = json.loads(swarmctl("restart", "swarm.yaml", "--json", cwd=folder).stdout)
    assert document["restarted"]["one"] == ["r1.service"]
