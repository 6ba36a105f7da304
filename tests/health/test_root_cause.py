"""Any faults together: every cause comes before its symptoms; without one, nothing is reported."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from swarmctl.health.diagnosis import diagnose
from swarmctl.health.verdict import State
from tests.health import test_driver_faults, test_host_faults, test_master_faults, test_robot_faults
from tests.health.faults import AWAY, shape
from tests.health.swarm_values import HOSTS, Spoil, all_well, graph

_TABLES = (
    test_driver_faults.FAULTS,
    test_host_faults.FAULTS,
    test_master_faults.FAULTS,
    test_robot_faults.FAULTS,
)
_SPOILS = st.sampled_from([(fault.host, fault.spoil) for table in _TABLES for fault in table.values()])


def test_all_well_is_healthy_and_silent() -> None:
    found = diagnose(graph(), all_well())
    assert found.healthy
    assert shape(found) == {}
    assert all(one.state is State.OK for one in found.findings)


@given(st.lists(_SPOILS, max_size=4), st.sets(st.sampled_from(HOSTS)))
def test_every_cause_comes_before_its_symptoms(spoils: list[tuple[str, Spoil]], away: set[str]) -> None:
    answers: dict[str, Any] = all_well()
    for host, spoil in spoils:
        with suppress(KeyError, TypeError, AttributeError):  # an earlier one took away what this one spoils
            answers[host] = spoil(answers[host])
    found = diagnose(graph(), {**answers, **dict.fromkeys(away, AWAY)})
    seen: dict[str, Any] = {}
    for one in found.findings:
        assert one.cause is None or seen[one.cause].cause is None
        assert one.cause is None or one.state is not State.OK
        seen[one.key] = one
    assert len(seen) == len(found.findings)
    bad = {one.key for one in found.findings if one.state is State.BAD}
    assert bad <= {one.key for cause, symptoms in found.explained() for one in (cause, *symptoms)}
