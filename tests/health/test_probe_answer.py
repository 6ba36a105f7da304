"""The question fits the expected graph; whatever a host answers becomes values, never an exception."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.health.diagnosis import diagnose
from swarmctl.health.probe_answer import answer_of
from swarmctl.health.probe_request import listening, request
from swarmctl.health.swarm_health import status
from swarmctl.swarm.topics import DriverTopic
from swarmctl.views import status as view
from tests.health.swarm_values import (
    K3_PI,
    LAPTOP,
    UNIT,
    WLAN,
    all_well,
    graph,
)

_LEAVES = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8)
_NAMES = (
    "units nodes topics master devices release commanders reports level message rate count seconds "
    "registered alive restarts latency time troubles publishes subscribes nearby exists run_id reachable "
    "senders host values commander "
    f"/k3/driver {UNIT['k3']} /dev/swarm/k3 /k3/odom /k3/cmd_vel"
)
_KEYS = st.sampled_from(_NAMES.split())
_ANYTHING = st.recursive(
    _LEAVES,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(_KEYS, inner, max_size=8),
    max_leaves=40,
)


@given(st.dictionaries(_KEYS, _ANYTHING, max_size=12), st.sampled_from([K3_PI, LAPTOP]))
def test_whatever_a_host_answers_it_can_be_diagnosed_and_shown(data: dict[str, Any], host: str) -> None:
    answer = answer_of(json.loads(json.dumps(data)), received=0.0)
    outcomes = {**all_well(), host: answer}
    shown = status(graph(), outcomes, diagnose(graph(), outcomes))
    json.dumps(shown.to_json(), allow_nan=False)
    assert "\x1b" not in view.status(shown).plain


def test_texts_from_a_host_have_a_length() -> None:
    assert len(answer_of({"release": "x" * 10_000}).release or "") == 300


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 10**400, -(10**400), "1", True, None])
def test_a_number_that_is_none_is_unknown(value: Any) -> None:
    nodes = {"/k3/driver": {"topics": {"/k3/odom": {"rate": value}}}}
    assert answer_of({"nodes": nodes}).nodes["/k3/driver"].topics["/k3/odom"].rate is None


def test_the_worst_status_is_the_drivers_word() -> None:
    reports = [
        {"level": 0, "message": "fine"},
        {"level": 2, "message": "bad", "values": {"commander": "laptop (/teleop)"}},
        {"level": 1, "message": "so so"},
    ]
    report = answer_of({"nodes": {"/k3/driver": {"reports": reports}}}).nodes["/k3/driver"].report
    assert report is not None
    assert (report.level, report.message, report.commander) == (2, "bad", "laptop (/teleop)")


def test_a_host_is_probed_for_its_own_part() -> None:
    sent = request(graph(), graph().hosts[1], window=2.0)
    assert sent == {
        "verb": "probe",
        "swarm": "newswarm",
        "module": "swarm_ros1_probe.observe",
        "units": [WLAN, UNIT["k3"], "swarm-newswarm.target"],
        "master": "http://192.168.77.10:11311",
        "nodes": [
            {
                "name": "/k3/driver",
                "topics": {
                    "/k3/odom": 2.0,
                    "/k3/proximity": 2.0,
                    "/k3/ground": 2.0,
                    "/k3/battery": 2.5,
                    "/diagnostics": 2.5,
                },
            }
        ],
        "graph": None,
        "commands": [],
        "command_types": [],
        "publishers": {},
        "peers": [],
        "devices": ["/dev/swarm/k3"],
        "launched": {},
        "advertised": "192.168.77.11",
        "restart_window": 600.0,
        "images": {},
        "clock": None,
    }


def test_the_hub_is_probed_for_the_commanders_of_every_robot() -> None:
    hub = next(host for host in graph().hosts if host.name == LAPTOP)
    assert request(graph(), hub, 2.0)["commands"] == ["/koala/cmd_vel", "/k3/cmd_vel", "/epuck/cmd_vel"]


def test_a_robot_publishes_what_its_type_has() -> None:
    assert {topic.name for topic in graph().robots[0].topics} == {
        "/koala/odom",
        "/koala/proximity",
        "/koala/battery",
        "/diagnostics",
    }


@pytest.mark.parametrize(("rate", "seconds"), [(10.0, 2.0), (1.0, 2.5), (0.5, 5.0), (0.01, 10.0)])
def test_a_slow_topic_is_listened_to_for_longer(rate: float, seconds: float) -> None:
    assert listening(DriverTopic("/k3/odom", "nav_msgs/Odometry", rate), 2.0) == seconds


def test_a_request_is_json() -> None:
    host = replace(graph().hosts[0], robots=graph().robots)
    assert json.loads(json.dumps(request(graph(), host, 2.0))) == request(graph(), host, 2.0)
