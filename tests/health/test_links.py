"""Lost packets between hosts are a finding of the link, and the cause of what the host does not reach."""

from __future__ import annotations

from typing import Any

import pytest
from swarm_onboard.agent.observations import MasterSeen, PingSeen

from swarmctl.health.collect import request
from swarmctl.health.diagnosis import diagnose
from tests.health import test_bridge_checks as isles
from tests.health.faults import shape
from tests.health.swarm_values import K3_PI, LAPTOP, all_well, graph, with_node

HUB = "192.168.77.10"
LINK = f"link {K3_PI} to {LAPTOP}"


def lossy(received: int, sent: int = 40, **other: Any) -> dict[str, Any]:
    answers = all_well()
    return {**answers, K3_PI: answers[K3_PI]._replace(pings={HUB: PingSeen(sent, received)}, **other)}


@pytest.mark.parametrize(
    ("received", "sent", "state"),
    [(40, 40, None), (37, 40, None), (36, 40, "warning"), (25, 40, "warning"), (24, 40, "bad"),
     (1, 40, "bad"), (0, 40, None), (2, 4, None), (1, 4, "bad")],
)  # fmt: skip
def test_the_share_of_lost_pings_decides(received: int, sent: int, state: str | None) -> None:
    """A host may be set to answer none: whether TCP reaches it is a matter of other checks."""
    assert shape(diagnose(graph(), lossy(received, sent))) == ({LINK: (state, [])} if state else {})


def test_a_lossy_link_explains_what_is_not_reached() -> None:
    answers = lossy(20, master=MasterSeen(False, "no answer within 2 s"), nodes={})
    assert shape(diagnose(graph(), answers)) == {LINK: ("bad", [f"master {K3_PI}", "driver k3"])}


def test_a_master_that_did_not_answer_for_one_node_is_a_symptom_of_it() -> None:
    unknown = with_node("k3", registered=None, alive=None, error="no answer within 2 s")
    diagnosis = diagnose(graph(), {**all_well(), K3_PI: unknown(lossy(30)[K3_PI])})
    assert shape(diagnosis) == {LINK: ("warning", ["driver k3"])}
    text = next(one.message for one in diagnosis.findings if one.key == "driver k3")
    assert text == "/k3/driver was not checked: no answer within 2 s"


def test_hosts_ping_their_hub_and_hubs_each_other() -> None:
    assert {host.name: request(graph(), host, 2.0).pings for host in graph().hosts} == {
        LAPTOP: {}, K3_PI: {HUB: 2.0}, "epuck-pi": {HUB: 2.0},
    }  # fmt: skip
    shown = isles.graph()
    assert [request(shown, host, 2.0).pings for host in shown.hosts] == [
        {"192.168.77.11": 2.0},
        {HUB: 2.0},
    ]
