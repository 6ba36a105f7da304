"""The question fits the expected graph; whatever fits the type of the answer becomes values, no exception."""

from __future__ import annotations

import json
from dataclasses import replace
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, is_typeddict

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from swarm_onboard.agent.probe_messages import ProbeAnswer

from swarmctl.health.diagnosis import diagnose
from swarmctl.health.host_checks import host_checks
from swarmctl.health.probe_answer import answer_of
from swarmctl.health.probe_request import listening, request
from swarmctl.health.swarm_health import status
from swarmctl.remote.answer_check import mismatch, types_of
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

_INTEGERS = st.integers(-(2**63) + 1, 2**63 - 1)
_SCALARS = {
    str: st.text(max_size=8) | st.sampled_from(["active", "failed", "pending", "applying", "\x1b[31m"]),
    bool: st.booleans(), int: _INTEGERS, float: _INTEGERS | st.floats(-9e18, 9e18), NoneType: st.none(),
}  # fmt: skip
_KEYS = st.sampled_from([
    "/k3/driver", "/k3/odom", "/k3/cmd_vel", "/koala/driver", "/dev/swarm/k3", "k3", "koala", "commander",
    "refused nodes", "files", UNIT["k3"], UNIT["koala"], WLAN,
])  # fmt: skip


def fitting(kind: Any) -> st.SearchStrategy[Any]:
    """JSON of the type ``kind`` of an answer."""
    origin, inner = get_origin(kind), get_args(kind)
    if kind == types_of(ProbeAnswer)["checks"]:
        checks = {name: fitting(list[one.Seen]) for name, one in host_checks().items()}
        return st.fixed_dictionaries({}, optional=checks)
    if hasattr(kind, "_fields"):
        return st.fixed_dictionaries({name: fitting(one) for name, one in types_of(kind).items()})
    if is_typeddict(kind):
        parts = {name: fitting(one) for name, one in types_of(kind).items()}
        optional = {name: parts.pop(name) for name in sorted(kind.__optional_keys__)}
        return st.fixed_dictionaries(parts, optional=optional)
    if origin is Literal:
        return st.sampled_from(inner)
    if origin in (Union, UnionType):
        return st.one_of(*map(fitting, inner))
    if origin is list:
        return st.lists(fitting(inner[0]), max_size=3)
    if origin is dict:
        return st.dictionaries(_KEYS, fitting(inner[1]), max_size=3)
    return _SCALARS[kind]


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(fitting(ProbeAnswer), st.sampled_from([K3_PI, LAPTOP]))
def test_whatever_fits_can_be_diagnosed_and_shown(data: dict[str, Any], host: str) -> None:
    assert mismatch(data, ProbeAnswer) == ""
    outcomes = {**all_well(), host: answer_of(json.loads(json.dumps(data)), received=0.0)}
    shown = status(graph(), outcomes, diagnose(graph(), outcomes))
    json.dumps(shown.to_json(), allow_nan=False)
    assert "\x1b" not in view.status(shown).plain


def test_texts_from_a_host_have_a_length() -> None:
    assert len(answer_of({"release": "x" * 10_000}).release or "") == 300


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 10**400, -(10**400), "1", True])
def test_a_number_that_is_none_costs_the_hosts_answer(value: Any) -> None:
    topic = {"count": 1, "rate": value, "age": None, "seconds": 2.0, "type": "", "error": ""}
    nodes = {"/k3/driver": {"topics": {"/k3/odom": topic}}}
    place = "the answer.nodes./k3/driver.topics./k3/odom.rate"
    assert mismatch({"nodes": nodes}, ProbeAnswer) == f"{place} is not a number or null"


def test_the_worst_status_is_the_drivers_word() -> None:
    reports = [
        {"level": 0, "message": "fine", "values": {}},
        {"level": 2, "message": "bad", "values": {"commander": "laptop (/teleop)"}},
        {"level": 1, "message": "so so", "values": {}},
    ]
    report = answer_of({"nodes": {"/k3/driver": {"reports": reports}}}).nodes["/k3/driver"].report
    assert report is not None
    assert (report.level, report.message, report.commander) == (2, "bad", "laptop (/teleop)")


def test_a_host_is_probed_for_its_own_part() -> None:
    sent = request(graph(), graph().hosts[1], window=2.0)
    assert sent == {
        "verb": "probe",
        "swarm": "newswarm",
        "module": "swarm_onboard.ros1_probe.observe",
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
                "parameters": sent["nodes"][0]["parameters"],
            }
        ],
        "graph": None,
        "commands": [],
        "command_types": [],
        "publishers": {},
        "homes": {},
        "peers": [],
        "expected": {},
        "inputs": ["/k3/cmd_vel"],
        "provides": [],
        "devices": ["/dev/swarm/k3"],
        "launched": {},
        "advertised": "192.168.77.11",
        "restart_window": 600.0,
        "images": {},
        "requires": [],
        "checks": list(host_checks()),
        "clock": None,
        "pings": {"192.168.77.10": 2.0},
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
