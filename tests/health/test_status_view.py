"""The table and the findings, as people see them: compared with the texts in ``golden``."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console
from swarm_onboard.agent.observations import Report
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.diagnosis import diagnose
from swarmctl.health.swarm_health import Status, status
from swarmctl.remote.transport import HostError, Kind
from swarmctl.views import status as view
from tests.health.swarm_values import (
    EPUCK_PI,
    K3_PI,
    LAPTOP,
    NO_ADAPTER,
    RFCOMM,
    UNIT,
    all_well,
    both,
    changed,
    graph,
    no_serial_port,
    with_master,
    with_node,
    with_senders,
    with_topic,
    with_unit,
)

GOLDEN = Path(__file__).parent / "golden"
ESCAPES = "\x1b]52;c;aGk=\x07\x9b2J\u202e"


def shown(outcomes: Mapping[str, Any]) -> Status:
    return status(graph(), outcomes, diagnose(graph(), outcomes))


def healthy() -> dict[str, Any]:
    """As in the lab: no Bluetooth adapter, but a device all the same; a joystick, and a teleop in use."""
    answers = all_well()
    answers[EPUCK_PI] = with_unit(RFCOMM, **NO_ADAPTER)(answers[EPUCK_PI])
    answers[LAPTOP] = both(
        with_senders("koala", joystick="192.168.77.10"), with_senders("k3", teleop="192.168.77.10")
    )(answers[LAPTOP])
    obeys = Report(0, "driving", "koala-laptop (/teleop)")
    answers[K3_PI] = with_node("k3", report=obeys)(answers[K3_PI])
    return answers


def intruded() -> dict[str, Any]:
    """Somebody on a host that does not command tries to drive."""
    answers = all_well()
    answers[LAPTOP] = with_senders("k3", rostopic_77="192.168.77.12")(answers[LAPTOP])
    refuses = "refuses /rostopic_77 on 192.168.77.12: not among its commanders koala-laptop"
    report = Report(1, f"standing still: no accepted command yet; {refuses}", "nobody", ("/rostopic_77",))
    answers[K3_PI] = with_node("k3", report=report)(answers[K3_PI])
    return answers


def departed() -> dict[str, Any]:
    """Somebody who may not command has tried to drive and has given up; a commander waited behind another."""
    answers = all_well()
    stranger = "/rostopic_77 on 192.168.77.12 (40 commands): not among its commanders koala-laptop"
    rejected = ("/rostopic_77", "/keys")
    report = Report(0, "standing still: no accepted command yet", "nobody", rejected, strangers=stranger)
    answers[K3_PI] = with_node("k3", report=report)(answers[K3_PI])
    return answers


def outdated() -> dict[str, Any]:
    """Healthy, but a host runs another release than the spec renders."""
    return {**all_well(), K3_PI: changed(release="0" * 16)(all_well()[K3_PI])}


def sick() -> dict[str, Any]:
    """An unplugged cable, a crash loop, an old release, and a node whose name attacks terminals."""
    answers = all_well()
    answers[K3_PI] = no_serial_port("k3")(answers[K3_PI])
    answers[EPUCK_PI] = both(
        with_unit(UNIT["epuck"], active="activating", sub="auto-restart", restarts=7, result="exit-code"),
        with_node("epuck", registered=False, alive=None, report=None, topics={}),
    )(answers[EPUCK_PI])
    answers[LAPTOP] = both(
        changed(release="0" * 16),
        with_senders("koala", **{f"evil{ESCAPES}": "192.168.77.10"}),
        with_topic("koala", "/koala/odom", rate=3.14),
    )(answers[LAPTOP])
    return answers


def half_dead() -> dict[str, Any]:
    """The hub is off, and one of the others shows the wrong host key."""
    gone = both(with_master(reachable=False, error="no route to host"), changed(nodes={}))
    answers = {name: gone(answer) for name, answer in all_well().items()}
    return {
        **answers,
        LAPTOP: HostError(Kind.UNREACHABLE, "no answer from 192.168.77.10", "is it on, and in this network?"),
        EPUCK_PI: HostError(Kind.HOST_KEY, "the key is not the pinned one", "swarmctl trust"),
    }


@pytest.mark.parametrize("make", [healthy, outdated, intruded, departed, sick, half_dead])
def test_the_picture_is_the_golden_one(make: Any, golden: Callable[[Path, str], None]) -> None:
    golden(GOLDEN / f"{make.__name__}.txt", f"{view.status(shown(make())).plain}\n")


def test_what_is_unhealthy_stands_above_what_is_skipped() -> None:
    answers = all_well()
    skipped = with_unit("swarm-newswarm.master.service", active="inactive", sub="dead", skipped=True)
    answers[LAPTOP] = skipped(answers[LAPTOP])
    answers[K3_PI] = no_serial_port("k3")(answers[K3_PI])
    text = view.status(shown(answers)).plain
    assert text.index("✗ device k3") < text.index("- skipped: unit swarm-newswarm.master")


def test_of_two_faults_the_one_with_more_symptoms_stands_first() -> None:
    answers = all_well()
    answers[LAPTOP] = with_unit(UNIT["koala"], recent=5)(answers[LAPTOP])
    answers[K3_PI] = no_serial_port("k3")(answers[K3_PI])
    text = view.status(shown(answers)).plain
    assert text.index("✗ device k3") < text.index("✗ unit swarm-newswarm.koala.service")


def test_nothing_from_a_host_reaches_the_terminal_raw() -> None:
    def attacked(answer: Answer) -> Answer:
        return both(
            changed(release=ESCAPES, troubles={ESCAPES: ESCAPES}),
            with_unit(UNIT["k3"], sub=ESCAPES, text=ESCAPES, result=ESCAPES),
            with_node("k3", uri=ESCAPES, error=ESCAPES, publishes={"/k3/odom": ESCAPES}),
            with_master(run_id=ESCAPES, error=ESCAPES, reachable=False),
        )(answer)

    answers = all_well()
    error = HostError(Kind.FAILED, ESCAPES, ESCAPES)
    found = shown({**answers, K3_PI: attacked(answers[K3_PI]), EPUCK_PI: error})
    screen = io.StringIO()
    Console(file=screen, force_terminal=True, color_system=None, width=200).print(view.status(found))
    assert not set(ESCAPES) & set("\x1b\x07\x9b\u202e") & set(screen.getvalue())


def test_many_symptoms_are_counted_not_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(view, "MOST_SYMPTOMS", 1)
    dead = both(with_master(reachable=False, error="connection refused"), changed(nodes={}))
    answers = {name: dead(answer) for name, answer in all_well().items()}
    text = view.status(shown({**answers, LAPTOP: dead(answers[LAPTOP])})).plain
    assert "k3-pi, epuck-pi: http://192.168.77.10:11311 does not answer" in text
    assert "was not checked" not in text
    assert "    ... and 3 more\n" in text


def test_the_json_form_says_the_same() -> None:
    document = json.loads(json.dumps(shown(sick()).to_json(), allow_nan=False))
    assert (document["v"], document["swarm"], document["healthy"]) == (1, "newswarm", False)
    assert [host["name"] for host in document["hosts"]] == [LAPTOP, K3_PI, EPUCK_PI]
    k3 = document["hosts"][1]["robots"][0]
    assert (k3["name"], k3["state"], k3["device_exists"]) == ("k3", "bad", False)
    odom = {"name": "/k3/odom", "type": "nav_msgs/Odometry", "rate": 0.0, "expected": 10.0, "age": None}
    assert k3["topics"][0] == odom
    causes = {one["key"]: one["cause"] for one in document["findings"]}
    assert causes["topic /k3/odom of k3"] == "device k3"
    assert causes["device k3"] is None
