"""The question fits the expected graph; whatever fits the type of the answer becomes values, no exception."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from swarm_onboard.agent.observations import NodeSeen, Status, TopicSeen, worst
from swarm_onboard.agent.verbs.probe import Answer, Request

from swarmctl.health.collect import checks_of, listening, request
from swarmctl.health.diagnosis import diagnose
from swarmctl.health.host_checks import host_checks
from swarmctl.health.swarm_health import status
from swarmctl.remote.answer_check import checked, cut, parsed
from swarmctl.remote.transport import HostError
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


def fields(kind: Any) -> dict[str, st.SearchStrategy[Any]]:
    """JSON of each field of a named tuple."""
    hints = get_type_hints(kind, localns={"Literal": Literal, "Any": Any})
    return {name: fitting(hints[name]) for name in kind._fields if hints[name] != Mapping[str, Sequence[Any]]}


def fitting(kind: Any) -> st.SearchStrategy[Any]:
    """JSON of the type ``kind``: a named tuple is a list."""
    origin, inner = get_origin(kind), get_args(kind)
    if hasattr(kind, "_fields"):
        return st.tuples(*fields(kind).values()).map(list)
    if origin is Literal:
        return st.sampled_from(inner)
    if origin in (Union, UnionType):
        return st.one_of(*map(fitting, inner))
    if origin in (list, Sequence):
        return st.lists(fitting(inner[0]), max_size=3)
    if origin in (dict, Mapping):
        return st.dictionaries(_KEYS, fitting(inner[1]), max_size=3)
    return _SCALARS[kind]


def answers() -> st.SearchStrategy[dict[str, Any]]:
    """JSON of an answer, from which fields may be missing."""
    checks = {name: st.lists(fitting(one.Seen), max_size=3) for name, one in host_checks().items()}
    return st.fixed_dictionaries(
        {}, optional={**fields(Answer), "checks": st.fixed_dictionaries({}, optional=checks)}
    )


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(answers(), st.sampled_from([K3_PI, LAPTOP]))
def test_whatever_fits_can_be_diagnosed_and_shown(data: dict[str, Any], host: str) -> None:
    answer = checked(parsed(json.dumps(data)), Answer, "the answer")
    outcomes = {**all_well(), host: answer._replace(checks=checks_of(answer), clock_ahead=answer.time)}
    shown = status(graph(), outcomes, diagnose(graph(), outcomes))
    json.dumps(shown.to_json(), allow_nan=False)
    assert "\x1b" not in view.status(shown).plain


def test_texts_from_a_host_have_a_length() -> None:
    found = {"release": "x" * 400, "y" * 400: [{"z": "x" * 400}], "count": 7}
    assert cut(found, 300) == {"release": "x" * 300, "y" * 300: [{"z": "x" * 300}], "count": 7}


@pytest.mark.parametrize("value", ["NaN", "Infinity", f"1{400 * '0'}", f"-1{400 * '0'}", '"1"', "true"])
def test_a_number_that_is_none_costs_the_hosts_answer(value: str) -> None:
    node = json.dumps(NodeSeen(topics={"/k3/odom": TopicSeen(rate=0.125)})).replace("0.125", value)
    found = parsed(f'{{"nodes": {{"/k3/driver": {node}}}}}')
    with pytest.raises(HostError, match=r"answer does not fit: nodes\./k3/driver\.7\./k3/odom\.1"):
        checked(found, Answer, "the answer")


def test_the_worst_status_is_the_drivers_word() -> None:
    report = worst([
        Status(0, "", "fine", {}),
        Status(2, "", "bad", {"commander": "laptop (/teleop)"}),
        Status(1, "", "so so", {}),
    ])  # fmt: skip
    assert report is not None
    assert (report.level, report.message, report.commander) == (2, "bad", "laptop (/teleop)")


def test_a_host_is_probed_for_its_own_part() -> None:
    sent = request(graph(), graph().hosts[1], window=2.0)
    assert sent == Request(
        "newswarm",
        "swarm_onboard.ros1_probe.observe",
        [WLAN, UNIT["k3"], "swarm-newswarm.target"],
        "http://192.168.77.10:11311",
        nodes={
            "/k3/driver": {
                "/k3/odom": 2.0,
                "/k3/proximity": 2.0,
                "/k3/ground": 2.0,
                "/k3/battery": 2.5,
                "/diagnostics": 2.5,
            },
        },
        parameters=sent.parameters,
        commands=[],
        command_types=[],
        peers=[],
        inputs=["/k3/cmd_vel"],
        provides=[],
        devices=["/dev/swarm/k3"],
        advertised="192.168.77.11",
        restart_window=600.0,
        checks=list(host_checks()),
        pings={"192.168.77.10": 2.0},
        requires=[],
    )
    assert list(sent.parameters) == ["/k3/driver"]


def test_the_hub_is_probed_for_the_commanders_of_every_robot() -> None:
    hub = next(host for host in graph().hosts if host.name == LAPTOP)
    assert request(graph(), hub, 2.0).commands == ["/koala/cmd_vel", "/k3/cmd_vel", "/epuck/cmd_vel"]


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
    sent = request(graph(), host, 2.0)
    assert json.loads(json.dumps(sent._asdict())).keys() == sent._asdict().keys()
