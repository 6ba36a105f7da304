"""The checks of a host itself: what a host may report for them."""

from __future__ import annotations

from typing import Any

import pytest
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.collect import checks_of
from swarmctl.health.host_checks import host_checks
from swarmctl.remote.transport import HostError, Kind


def test_what_a_host_reports_has_the_type_of_its_check() -> None:
    found = checks_of(Answer(checks={"memory": [[1024, 512]], "of a newer agent": [1]}))
    assert found == {"memory": [host_checks()["memory"].Seen(1024, 512)]}


@pytest.mark.parametrize("lie", [[["much", 512]], [[1]], [[1, 2, 3]], [None]])
def test_a_host_that_lies_is_refused(lie: Any) -> None:
    with pytest.raises(HostError, match="what the host observed for `memory` does not fit") as found:
        checks_of(Answer(checks={"memory": lie}))
    assert found.value.kind is Kind.PROTOCOL
