"""A status that was written as JSON is read again as the same value, and nothing else is taken for one."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import pytest

from swarmctl.health.diagnosis import diagnose
from swarmctl.health.root_cause import Diagnosis
from swarmctl.health.swarm_health import Status, status
from swarmctl.health.verdict import State
from tests.health import test_driver_faults, test_host_faults, test_master_faults, test_robot_faults
from tests.health.faults import AWAY, spoilt
from tests.health.swarm_values import HOSTS, K3_PI, all_well, graph, nothing_deployed

TABLES = (test_driver_faults, test_host_faults, test_master_faults, test_robot_faults)
FAULTS = {
    f"{table.__name__.rpartition('.')[2]} {name}": spoilt(fault.host, fault.spoil)
    for table in TABLES
    for name, fault in table.FAULTS.items()
}
ANSWERS: dict[str, Any] = {
    "all well": all_well(),
    "nothing deployed": {name: nothing_deployed(one) for name, one in all_well().items()},
    "nobody there": dict.fromkeys(HOSTS, AWAY),
    "one away": {**all_well(), K3_PI: AWAY},
    **FAULTS,
}


def seen(answers: Any) -> Status:
    return status(graph(), answers, diagnose(graph(), answers))


def written(shown: Status) -> Any:
    return json.loads(json.dumps(shown.to_json()))


@pytest.mark.parametrize("answers", ANSWERS.values(), ids=ANSWERS.keys())
def test_a_status_is_read_as_it_was_written(answers: Any) -> None:
    shown = seen(answers)
    assert Status.from_json(written(shown)).to_json() == shown.to_json()


@pytest.mark.parametrize("state", State)
def test_each_state_is_read_as_it_was_written(state: State) -> None:
    shown = seen(all_well())
    findings = tuple(replace(one, state=state) for one in shown.diagnosis.findings)
    hosts = tuple(replace(host, state=state) for host in shown.hosts)
    shown = replace(shown, hosts=hosts, diagnosis=Diagnosis(findings))
    assert Status.from_json(written(shown)).to_json() == shown.to_json()


@pytest.mark.parametrize(
    "change",
    [
        {"v": 2},
        {"healthy": False},
        {"more": 1},
        {"hosts": [{"name": "k3-pi"}]},
        {"hosts": None},
        {"findings": [{"check": "host", "subject": "k3-pi", "state": "fine", "message": ""}]},
    ],
)
def test_another_document_is_no_status(change: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="not what status --json prints"):
        Status.from_json(written(seen(all_well())) | change)


@pytest.mark.parametrize("document", [None, [], "status", {}])
def test_another_value_is_no_status(document: Any) -> None:
    with pytest.raises(ValueError, match="not what status --json prints"):
        Status.from_json(document)
