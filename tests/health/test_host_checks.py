"""The checks of a host itself: what a host may report for them."""

from __future__ import annotations

from typing import Any

import pytest

from swarmctl.health.host_checks import host_checks
from swarmctl.health.probe_answer import answer_of
from swarmctl.remote.transport import HostError, Kind

MEMORY = {"size": 1024, "available": 512}


def test_what_a_host_reports_has_the_type_of_its_check() -> None:
    found = answer_of({"checks": {"memory": [MEMORY], "of a newer agent": [1]}}).checks
    assert found["memory"] == (host_checks()["memory"].Seen(1024, 512),)
    assert not found["of a newer agent"]


@pytest.mark.parametrize("lie", [[{**MEMORY, "size": "much"}], [{"size": 1}], {"size": 1}, [None]])
def test_a_host_that_lies_is_refused(lie: Any) -> None:
    with pytest.raises(HostError, match="what the host observed for `memory` does not fit") as found:
        answer_of({"checks": {"memory": lie}})
    assert found.value.kind is Kind.PROTOCOL
